"""Simple shear between bumpy walls, in LIGGGHTS: cross-check of the homogeneous shear in LAMMPS.

Two layers of glued grains move apart along x; x and z are periodic. Walls heat or cool the flow and
order the grains near them, so only the middle of a wide gap is averaged and compared through what
is local, p/(rho_s T) and s/p at the core's own solid fraction, rather than through T/(gdot d)^2.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from compare.element.case import Case
from compare.element.records import Rows
from compare.element.tests import ElementTest, register
from dem_reference.engine import Liggghts
from dem_reference.grains import Grains
from dem_reference.periodic.start import random_positions
from dem_reference.process import Report, run_engine

CORE = 0.4  # middle part of the gap that is averaged
WIDTH, DEPTH = 8, 6  # glued grains of a wall along x and along z
SPACING = 1.1  # of theirs, over d
SETUP = """\
atom_style granular
atom_modify map array
boundary p f p
newton off
communicate single vel yes
units si
processors * 1 1
region box block 0 {lx} {low} {high} 0 {lz} units box
create_box 2 box
neighbor {d} bin
neigh_modify delay 0
fix m1 all property/global youngsModulus peratomtype {E} {E}
fix m2 all property/global poissonsRatio peratomtype {nu} {nu}
fix m3 all property/global coefficientRestitution peratomtypepair 2 {e} {e} {e} {e}
fix m4 all property/global coefficientFriction peratomtypepair 2 {mu} {mu} {mu} {mu}
pair_style gran model hertz tangential history
pair_coeff * *
timestep {dt}
"""
GROUPS = """\
group flow type 1
group walls type 2
region half block INF INF INF {middle} INF INF units box
group below region half
group lower intersect walls below
group upper subtract walls lower
"""
SHEAR = """\
set group all density {rho}
set group walls diameter {d}
set group flow diameter {d0}
neigh_modify exclude group walls walls
fix move flow nve/sphere
compute st all stress/atom
compute top all reduce sum c_st[2]
thermo_style custom step atoms c_top
thermo_modify lost error norm no flush yes
thermo 1000000000
variable d equal ramp({d0},{d})
fix grow flow adapt 20 atom diameter v_d
run 20000 post no
unfix grow
set group flow diameter {d} density {rho}
neighbor {skin} bin
velocity lower set -{v} 0 0 units box
velocity upper set {v} 0 0 units box
fix lower lower move linear -{v} 0 0 units box
fix upper upper move linear {v} 0 0 units box
velocity flow ramp vx -{v} {v} y 0 {gap} units box
"""


def points(case: Case) -> list[tuple[dict, int]]:
    """Seed by seed."""
    strain = {
        "strain": case["bumpy_shear.strain"],
        "strain_discarded": case["bumpy_shear.strain_discarded"],
    }
    return [
        ({"solid_fraction": fraction, "shear_rate": rate} | strain, seed)
        for seed in case["element.seeds"]
        for rate in case["bumpy_shear.rates"]
        for fraction in case["bumpy_shear.solid_fractions"]
    ]


def run(grains: Grains, point: dict, folder: Path) -> Rows:
    """Shears grains between two walls at point's mean shear rate; one row, as `core_means`."""
    log = folder / "log.liggghts"
    return [run_engine(shear, grains, point, log, log=log).result]


def shear(grains: Grains, point: dict, log: Path, report: Report) -> dict:
    d, dt = grains.diameter, point["time_step_fraction"] * grains.rayleigh_time()
    lx, lz = WIDTH * SPACING * d, DEPTH * SPACING * d
    solid_area = point["solid_fraction"] * lx * lz
    gap = d + point["grains"] * grains.volume / solid_area  # between the walls' centres
    engine = set_up(grains, point, (lx, gap, lz), dt, log)

    interval = 100
    samples = []
    for step in range(round(point["strain"] / (point["shear_rate"] * dt) / interval)):
        engine.advance(interval)
        if step * interval * dt * point["shear_rate"] < point["strain_discarded"]:
            continue
        y = engine.vectors("x")[:, 1]
        share = part_within(y - gap / 2, CORE * gap / 2, d / 2)
        core = (engine.atoms()["type"] == 1) & (share > 0)
        virial = -engine.per_atom("st", 6)[core][:, [0, 1, 2, 3]]
        samples.append(
            Sample(share[core], y[core], engine.vectors("v")[core], share[core] @ virial)
        )
    return core_means(grains, samples, CORE * gap * lx * lz)


def set_up(
    grains: Grains, point: dict, sides: tuple[float, float, float], dt: float, log: Path
) -> Liggghts:
    """The grains between the walls, which have begun to move; `sides` of the gap [m]."""
    d, (lx, gap, lz) = grains.diameter, sides
    centres, d0 = random_positions(point["grains"], (lx, gap - 2 * d, lz), point["seed"])
    x, z = np.meshgrid(
        (np.arange(WIDTH) + 0.5) * SPACING * d, (np.arange(DEPTH) + 0.5) * SPACING * d
    )
    wall = np.column_stack([x.ravel(), np.zeros(x.size), z.ravel()])

    engine = Liggghts(log)
    engine.commands(
        SETUP.format(
            lx=lx,
            lz=lz,
            low=-2 * d,
            high=gap + 2 * d,
            d=d,
            E=grains.young_modulus,
            nu=grains.poisson_ratio,
            e=grains.restitution,
            mu=grains.friction,
            dt=dt,
        )
    )
    engine.create(centres + [0, d, 0])
    engine.create(wall, 2)
    engine.create(wall + [0, gap, 0], 2)
    engine.commands(GROUPS.format(middle=gap / 2))
    speed = point["shear_rate"] * gap / 2
    engine.commands(SHEAR.format(rho=grains.density, d=d, d0=d0, skin=0.2 * d, v=speed, gap=gap))
    engine.command("run 0 post no")
    return engine


class Sample(NamedTuple):
    """What is in the core at one instant, n grains of it."""

    share: np.ndarray  # (n,) of each grain that lies in the core [-]
    y: np.ndarray  # (n,) [m]
    velocity: np.ndarray  # (n, 3) [m/s]
    virial: np.ndarray  # (4,) of all of them: xx, yy, zz, xy [J]


def core_means(grains: Grains, samples: list[Sample], volume: float) -> dict:
    """Means over samples of a core of `volume` [m3].

    core_solid_fraction [-], core_shear_rate [1/s], granular_temperature [m2/s2] about the core's
    linear velocity profile, pressure and shear_stress [Pa].
    """
    number = np.mean([sample.share.sum() for sample in samples])
    share, y, velocity = (np.concatenate([sample[i] for sample in samples]) for i in (0, 1, 2))
    slope, offset = np.polyfit(y, velocity[:, 0], 1, w=np.sqrt(share))
    own = velocity - np.column_stack([slope * y + offset, np.zeros((len(y), 2))])

    def kinetic(u: np.ndarray) -> np.ndarray:
        ux, uy, uz = u.T
        pairs = ((ux, ux), (uy, uy), (uz, uz), (ux, uy))
        means = np.array([np.average(a * b, weights=share) for a, b in pairs])
        return grains.mass * means * number

    # The engine's kinetic part holds the whole velocity: take it out, and put in that of the
    # fluctuations.
    virial = np.mean([sample.virial for sample in samples], axis=0)
    xx, yy, zz, xy = (virial - kinetic(velocity) + kinetic(own)) / volume
    return {
        "core_solid_fraction": float(number * grains.volume / volume),
        "core_shear_rate": float(slope),
        "granular_temperature": float(np.average(np.mean(own**2, axis=1), weights=share)),
        "pressure": float((xx + yy + zz) / 3),
        "shear_stress": float(-xy),
    }


def part_within(height: np.ndarray, half: float, radius: float) -> np.ndarray:
    """Fraction of each sphere at `height` [m] that lies in |y| < half.

    Grains form layers, so centres alone mislead.
    """

    def below(h):  # fraction of a sphere below h from its centre: (r + h)^2 (2 r - h)/(4 r^3)
        h = np.clip(h, -radius, radius)
        return (radius + h) ** 2 * (2 * radius - h) / (4 * radius**3)

    return below(half - height) - below(-half - height)


register(
    ElementTest(
        "bumpy_shear",
        order=5,
        keys=("solid_fraction", "shear_rate"),
        points=points,
        run=run,
    )
)
