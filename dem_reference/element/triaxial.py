"""Drained triaxial compression at constant lateral stress, in LIGGGHTS: an orthogonal periodic box under servo control."""
from pathlib import Path

import numpy as np

from dem_reference.element import liggghts
from dem_reference.element.grains import Grains
from dem_reference.element.packing import box_side
from dem_reference.element.servo import Servo

KEYS = ("pressure", "preparation_friction")
LOOSE = 0.50  # solid fraction from which the isotropic preparation compresses


def points(case) -> list[tuple[dict, int]]:
    """Every (point, seed), seed by seed."""
    common = {
        name: case[f"triaxial.{name}"] for name in ("axial_strain", "inertial_number", "samples")
    }
    return [
        ({"pressure": pressure, "preparation_friction": friction} | common, seed)
        for seed in case["element.seeds"]
        for friction in case["triaxial.preparation_frictions"]
        for pressure in case["triaxial.pressures"]
    ]


def rate_of(inertial_number: float, grains: Grains, pressure: float) -> float:
    """Strain rate of an inertial number: I sqrt(p/rho_s)/d [1/s]."""
    return inertial_number * np.sqrt(pressure / grains.density) / grains.diameter


def prepare(grains: Grains, point: dict, pressure: float, log: Path) -> liggghts.Box:
    """A packing at rest under isotropic `pressure` [Pa], compressed with the preparation's friction, then given its own."""
    side = box_side(grains, point["grains"], LOOSE)
    box = liggghts.Box(
        grains,
        point["grains"],
        side,
        point["seed"],
        point["preparation_friction"],
        grains.time_step(point["time_step_fraction"]),
        log,
    )
    servo = Servo(box, pressure, rate_limit=rate_of(0.01, grains, pressure))
    servo.isotropic(pressure)
    box.set_friction(grains.friction)
    servo.isotropic(pressure)
    return box


def run(grains: Grains, point: dict, folder: Path) -> list[dict]:
    """Compresses one box along y; returns one row per sample, averaged over the servo's corrections since the last one.

    axial_strain, volumetric_strain [-] (logarithmic, compression positive), void_ratio [-], axial_stress and the
    lateral_stress (mean of two) [Pa], lateral_error (worst relative deviation of a mean lateral stress), coordination [-].
    """
    return liggghts.in_child(compress, grains, point, folder, log=folder / "log.liggghts")


def compress(grains: Grains, point: dict, folder: Path) -> list[dict]:
    pressure = point["pressure"]
    box = prepare(grains, point, pressure, folder / "log.liggghts")
    rate = rate_of(point["inertial_number"], grains, pressure)
    servo = Servo(box, pressure, rate_limit=10 * rate)
    corrections = max(
        1, round(point["axial_strain"] / point["samples"] / (rate * servo.INTERVAL * box.time_step))
    )
    start = box.sides

    def row(stresses: list) -> dict:
        strain = np.log(start / box.sides)
        x, y, z = np.mean(stresses, axis=0)
        return {
            "axial_strain": strain[1],
            "volumetric_strain": strain.sum(),
            "void_ratio": box.void_ratio,
            "axial_stress": y,
            "lateral_stress": (x + z) / 2,
            "lateral_error": max(abs(x / pressure - 1), abs(z / pressure - 1)),
            "coordination": box.compute("z"),
        }

    rows = [row([box.stress])]
    targets, rates = np.array([pressure, np.nan, pressure]), np.array([0.0, rate, 0.0])
    for start_up in np.linspace(
        0, 1, corrections, endpoint=False
    ):  # a sudden start would send a stress wave
        servo.advance(targets, start_up * rates)
    rows.append(row([box.stress]))
    for _ in range(point["samples"]):
        rows.append(row([servo.advance(targets, rates) for _ in range(corrections)]))
    return [{name: float(value) for name, value in row.items()} for row in rows]
