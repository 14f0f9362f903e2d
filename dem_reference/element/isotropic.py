"""Isotropic compression and unloading, with small probes of the elastic moduli, in LIGGGHTS.

At each pressure the packing is brought to rest and probed twice: all sides by +-probe_strain (bulk modulus), then one side by
+-probe_strain and the others by -+half of it (shear modulus).
"""
from pathlib import Path

import numpy as np

from dem_reference.element import liggghts
from dem_reference.element.grains import Grains
from dem_reference.element.servo import Servo
from dem_reference.element.triaxial import prepare, rate_of

KEYS = ("preparation_friction",)
REST = 2500  # steps of damping before a probe's stress is read
DAMPING = 1e-2  # viscous damping while coming to rest [kg/s]


def points(case) -> list[tuple[dict, int]]:
    """Every (point, seed), seed by seed."""
    common = {name: case[f"isotropic.{name}"] for name in ("inertial_number", "probe_strain")}
    return [
        (
            {"preparation_friction": friction, "pressures": case["isotropic.pressures"]} | common,
            seed,
        )
        for seed in case["element.seeds"]
        for friction in case["isotropic.preparation_frictions"]
    ]


def run(grains: Grains, point: dict, folder: Path) -> list[dict]:
    """Takes one box through the pressures in turn; returns one row per pressure.

    pressure [Pa] as measured, unloading (0 or 1), void_ratio [-], coordination [-], bulk_modulus and shear_modulus [Pa].
    """
    return liggghts.in_child(compress, grains, point, folder, log=folder / "log.liggghts")


def compress(grains: Grains, point: dict, folder: Path) -> list[dict]:
    pressures = point["pressures"]
    box = prepare(grains, point, pressures[0], folder / "log.liggghts")
    rows = []
    for stage, pressure in enumerate(pressures):
        servo = Servo(box, pressure, rate_limit=rate_of(point["inertial_number"], grains, pressure))
        servo.isotropic(pressure)
        stress = at_rest(box)
        rows.append(
            {
                "pressure": float(stress.mean()),
                "unloading": int(pressure < max(pressures[: stage + 1])),
                "void_ratio": float(box.void_ratio),
                "coordination": box.compute("z"),
                "bulk_modulus": probe(box, np.ones(3), point["probe_strain"]).mean() / 3,
                "shear_modulus": probe(box, np.array([-0.5, 1.0, -0.5]), point["probe_strain"])
                @ [-0.5, 1, -0.5]
                / 3,
            }
        )
    return rows


def at_rest(box: liggghts.Box) -> np.ndarray:
    """Lets the grains come to rest in the box as it is; returns the stresses [Pa]."""
    box.command(f"fix damp all viscous {DAMPING}")
    box.deform(np.zeros(3), REST)
    box.command("unfix damp")
    return box.stress


def probe(box: liggghts.Box, direction: np.ndarray, strain: float, steps: int = 500) -> np.ndarray:
    """Stress change per strain when the sides shrink by +-strain x direction, and go back: shape (3,) [Pa]."""
    rates = direction * strain / (steps * box.time_step)
    box.deform(rates, steps)
    loaded = at_rest(box)
    box.deform(-2 * rates, steps)
    unloaded = at_rest(box)
    box.deform(rates, steps)
    return (loaded - unloaded) / (2 * strain)
