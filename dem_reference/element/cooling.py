"""Homogeneous cooling of a granular gas, in LIGGGHTS.

Without friction the tangential model is left out: with mu = 0 it still damps once at every set-up of a run.
"""
from pathlib import Path

import numpy as np

from dem_reference.element import liggghts
from dem_reference.element.grains import Grains
from dem_reference.element.packing import box_side

KEYS = ("solid_fraction", "friction")


def points(case) -> list[tuple[dict, int]]:
    """Every (point, seed), seed by seed."""
    common = {
        name: case[f"cooling.{name}"]
        for name in ("granular_temperature", "cooling_times", "samples")
    }
    return [
        ({"solid_fraction": fraction, "friction": friction} | common, seed)
        for seed in case["element.seeds"]
        for friction in case["cooling.frictions"]
        for fraction in case["cooling.solid_fractions"]
    ]


def haff_rate(nu: float, restitution: float, temperature: float, diameter: float) -> float:
    """1/tau of T = T0/(1 + t/tau)^2 for hard frictionless spheres [1/s].

    1/tau = (4/sqrt(pi)) (1 - e^2) nu g0 sqrt(T0)/d with g0 = (2 - nu)/(2 (1 - nu)^3) (Carnahan-Starling).
    """
    g0 = (2 - nu) / (2 * (1 - nu) ** 3)
    return 4 / np.sqrt(np.pi) * (1 - restitution**2) * nu * g0 * np.sqrt(temperature) / diameter


def run(grains: Grains, point: dict, folder: Path) -> list[dict]:
    """Cools one box; returns one row per instant: time [s], temperature and rotational_temperature [m2/s2].

    `temperature` is <v^2>/3, `rotational_temperature` the mean of I omega^2/(3 m). The grains start without spin, their
    velocities Gaussian, without mean, of variance granular_temperature exactly.
    """
    return liggghts.in_child(cool, grains, point, folder, log=folder / "log.liggghts")


def cool(grains: Grains, point: dict, folder: Path) -> list[dict]:
    side = box_side(grains, point["grains"], point["solid_fraction"])
    box = liggghts.Box(
        grains,
        point["grains"],
        side,
        point["seed"],
        point["friction"],
        grains.time_step(point["time_step_fraction"]),
        folder / "log.liggghts",
        tangential=point["friction"] > 0,
    )
    t0 = point["granular_temperature"]
    velocity = np.random.default_rng(point["seed"]).standard_normal((point["grains"], 3))
    velocity -= velocity.mean(axis=0)
    velocity *= np.sqrt(3 * t0 / np.mean(np.sum(velocity**2, axis=1)))
    box.array("v", point["grains"])[:] = velocity
    box.array("omega", point["grains"])[:] = 0.0
    box.command("run 0 post no")

    duration = point["cooling_times"] / haff_rate(
        point["solid_fraction"], grains.restitution, t0, grains.diameter
    )
    steps = max(1, round(duration / point["samples"] / box.time_step))
    rows = []
    for sample in range(point["samples"] + 1):
        if sample:
            box.run(steps)
        rows.append(
            {
                "time": sample * steps * box.time_step,
                "temperature": float(
                    np.mean(np.sum(box.array("v", point["grains"]) ** 2, axis=1)) / 3
                ),
                "rotational_temperature": float(
                    0.1
                    * grains.diameter**2
                    * np.mean(np.sum(box.array("omega", point["grains"]) ** 2, axis=1))
                    / 3
                ),
            }
        )
    return rows
