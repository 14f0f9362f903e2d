"""Homogeneous simple shear at constant volume, in LAMMPS with Lees-Edwards boundaries.

LAMMPS rather than LIGGGHTS because the latter deletes grains that cross a face of a triclinic box.
"""
from pathlib import Path

import numpy as np

from cases.errors import EngineError
from dem_reference.element import lammps
from dem_reference.element.grains import Grains
from dem_reference.element.packing import box_side, random_positions

BOLTZMANN = 1.380649e-23  # [J/K] in LAMMPS's si units
KEYS = ("solid_fraction", "shear_rate")
MEASURED = ("granular_temperature", "pressure", "shear_stress", "coordination")
SCRIPT = """\
units si
atom_style sphere 1
atom_modify map array
boundary p p p
newton off
comm_modify vel yes
box tilt large
read_data grains.data
pair_style granular
pair_coeff * * hertz/material {E} {e} {nu} tangential mindlin NULL 1.0 0.0 damping tsuji
neighbor {d} bin
neigh_modify delay 0
timestep {dt}
variable d equal ramp({d0},{d})
fix move all nve/sphere
fix grow all adapt 20 atom diameter v_d mass yes
run {grow_steps}
unfix grow
neighbor {skin} bin
reset_timestep 0
set group all diameter {d}
set group all density {rho}
pair_coeff * * hertz/material {E} {e} {nu} tangential mindlin NULL 1.0 {mu} damping tsuji
velocity all create {temperature} {velocity_seed} dist gaussian
velocity all ramp vx 0 {top_speed} y 0 {side} sum yes units box
fix shear all deform 1 xy erate {rate} remap v flip yes
compute T all temp/deform
compute P all pressure T
compute z all contact/atom
compute zm all reduce ave c_z
thermo_style custom step c_T c_P
thermo_modify lost error norm no flush yes
thermo {window}
fix mean all ave/time 10 {samples} {window} c_T c_P[1] c_P[2] c_P[3] c_P[4] c_zm file mean.txt
run {steps}
"""


def points(case) -> list[tuple[dict, int]]:
    """Every (point, seed): all void ratios at the first rate, seed by seed, then the next rate."""
    strain = {"strain": case["shear.strain"], "strain_discarded": case["shear.strain_discarded"]}
    return [
        ({"solid_fraction": fraction, "shear_rate": rate} | strain, seed)
        for rate in case["shear.rates"]
        for seed in case["element.seeds"]
        for fraction in case["shear.solid_fractions"]
    ]


def run(grains: Grains, point: dict, folder: Path) -> dict:
    """Shears one box to its steady state and returns its means.

    `point`: solid_fraction [-], shear_rate [1/s], seed, grains (number), strain and strain_discarded [-],
    time_step_fraction of the Rayleigh time. Returns granular_temperature [m2/s2] (affine flow removed), pressure
    and shear_stress [Pa] (contact and kinetic parts), coordination [-], first and second normal stress differences over
    p [-], and for the four of MEASURED the standard error of the mean over windows of half a unit of strain.
    """
    side = box_side(grains, point["grains"], point["solid_fraction"])
    centres, d0 = random_positions(point["grains"], side, point["seed"])
    write_data(folder / "grains.data", grains, centres, d0, side)

    dt = grains.time_step(point["time_step_fraction"])
    rate = point["shear_rate"]
    window = 10 * round(0.5 / (rate * dt) / 10)
    windows = round(2 * point["strain"])
    guess = 0.3 * (rate * grains.diameter) ** 2
    lammps.run(
        SCRIPT.format(
            E=grains.young_modulus,
            e=lammps.restitution_to_enter(grains.restitution),
            nu=grains.poisson_ratio,
            mu=grains.friction,
            rho=grains.density,
            d=grains.diameter,
            d0=d0,
            side=side,
            dt=dt,
            rate=rate,
            skin=0.2 * grains.diameter,
            grow_steps=20000,
            temperature=grains.mass * guess / BOLTZMANN,
            velocity_seed=10007 + point["seed"],
            top_speed=rate * side,
            window=window,
            samples=window // 10,
            steps=window * windows,
        ),
        folder,
    )

    rows = np.loadtxt(folder / "mean.txt")[:, 1:]
    rows = rows[round(2 * point["strain_discarded"]) :]
    if not np.isfinite(rows).all() or len(rows) < 2:
        raise EngineError(
            f"shear: no steady state was averaged ({len(rows)} finite windows) lengthen the strain"
        )
    temperature = rows[:, 0] * BOLTZMANN / grains.mass
    xx, yy, zz, xy = rows[:, 1:5].T
    pressure = (xx + yy + zz) / 3
    series = dict(zip(MEASURED, (temperature, pressure, -xy, rows[:, 5])))
    result = {name: float(values.mean()) for name, values in series.items()}
    result |= {
        f"{name}_error": float(values.std(ddof=1) / np.sqrt(len(values)))
        for name, values in series.items()
    }
    result |= {
        "normal_difference_1": float((xx - yy).mean() / pressure.mean()),
        "normal_difference_2": float((yy - zz).mean() / pressure.mean()),
    }
    return result


def write_data(
    path: Path, grains: Grains, centres: np.ndarray, diameter: float, side: float
) -> None:
    """A LAMMPS data file of grains of one `diameter` [m] in a periodic cube that may be sheared."""
    lines = [
        "grains",
        "",
        f"{len(centres)} atoms",
        "1 atom types",
        *(f"0 {side:.17g} {a}lo {a}hi" for a in "xyz"),
        "0 0 0 xy xz yz",
        "",
        "Atoms # sphere",
        "",
    ]
    lines += [
        f"{i} 1 {diameter:.17g} {grains.density} {x:.17g} {y:.17g} {z:.17g}"
        for i, (x, y, z) in enumerate(centres, 1)
    ]
    path.write_text("\n".join(lines) + "\n")
