"""Both DEM engines realise the restitution that is asked of them, and the same one."""
import subprocess

import numpy as np
import pytest

from dem_reference import lammps
from dem_reference.grains import Grains

SPEED = 0.1  # [m/s] each grain, towards the other
LAMMPS = """\
units si
atom_style sphere
atom_modify map array
boundary p p p
newton off
comm_modify vel yes
region box block 0 0.02 0 0.02 0 0.02
create_box 1 box
create_atoms 1 single 0.0089 0.01 0.01
create_atoms 1 single 0.0111 0.01 0.01
set group all diameter {d} density {rho}
pair_style granular
pair_coeff * * hertz/material {E} {entered} {nu} tangential mindlin NULL 1.0 {mu} damping tsuji
"""
LIGGGHTS = """\
atom_style granular
atom_modify map array
boundary p p p
newton off
communicate single vel yes
units si
region box block 0 0.02 0 0.02 0 0.02 units box
create_box 1 box
create_atoms 1 single 0.0089 0.01 0.01 units box
create_atoms 1 single 0.0111 0.01 0.01 units box
set group all diameter {d} density {rho}
fix m1 all property/global youngsModulus peratomtype {E}
fix m2 all property/global poissonsRatio peratomtype {nu}
fix m3 all property/global coefficientRestitution peratomtypepair 1 {entered}
fix m4 all property/global coefficientFriction peratomtypepair 1 {mu}
pair_style gran model hertz tangential history
pair_coeff * *
"""
COLLIDE = """\
neighbor 0.0004 bin
group left id 1
group right id 2
velocity left set {v} 0 0
velocity right set -{v} 0 0
timestep {dt}
fix move all nve/sphere
dump d all custom {steps} end.txt vx
dump_modify d format {format}
run {steps}
"""


@pytest.fixture
def grains():
    return Grains(2e-3, 2532.0, 3e8, 0.3, 0.879, 0.5)


def realised(engine, script, grains, entered, folder):
    """Separation speed over approach speed of a head-on collision."""
    dt = 0.05 * grains.rayleigh_time()
    steps = round(4e-4 / (SPEED / 0.1) / dt) + round(2e-3 / dt)
    text = (script + COLLIDE).format(
        d=grains.diameter,
        rho=grains.density,
        E=grains.young_modulus,
        nu=grains.poisson_ratio,
        mu=grains.friction,
        entered=entered,
        v=SPEED,
        dt=dt,
        steps=steps,
        format='"%.17g"' if engine == "liggghts" else "float %.17g",
    )
    (folder / "in.txt").write_text(text)
    subprocess.run(
        [engine, "-in", "in.txt", "-log", "log.txt"], cwd=folder, check=True, capture_output=True
    )
    first, second = np.array(
        [line.split()[0] for line in (folder / "end.txt").read_text().splitlines()[-2:]],
        dtype=float,
    )
    return abs(second - first) / (2 * SPEED)


def test_both_engines_realise_the_restitution_asked(grains, tmp_path):
    ours = realised(
        "lmp", LAMMPS, grains, lammps.restitution_to_enter(grains.restitution), tmp_path
    )
    theirs = realised("liggghts", LIGGGHTS, grains, grains.restitution, tmp_path)
    assert ours == pytest.approx(
        0.879, rel=1e-3
    )  # the damping law's own error, seen in both, is 3e-5
    assert ours == pytest.approx(
        theirs, abs=1e-9
    )  # same law, same integrator: only round-off apart


def test_lammps_without_the_inversion_is_too_elastic(grains, tmp_path):
    """The control: entering 0.879 as it is must miss by much more than the tolerance above."""
    assert realised("lmp", LAMMPS, grains, grains.restitution, tmp_path) == pytest.approx(
        0.9127, abs=2e-3
    )


@pytest.mark.parametrize("restitution", [0.3, 0.5, 0.7, 0.95])
def test_the_inversion_is_one(restitution):
    entered = lammps.restitution_to_enter(restitution)
    polynomial = np.polynomial.polynomial.polyval(entered, lammps.TSUJI)
    log = np.log(restitution)
    assert polynomial == pytest.approx(-np.sqrt(5) * log / np.hypot(log, np.pi), rel=1e-9)
