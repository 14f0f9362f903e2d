"""From a result file of a chute to what is measured of it."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cases.case import Case
from cases.errors import CaseError
from cases.scenes import gravity_of, is_chute
from cases.scratch import temporary
from compare.chute.flow import Flow, measure
from compare.maps import source
from compare.maps.profiles import mapped
from compare.mapping.runs import Run, open_run

SPACING = "0.125"  # of the profiles [d]: for difference quotients of a kernel of 0.75 d


@dataclass(frozen=True)
class Side:
    """One result file: its run, mean velocity of its frames (n,) [m/s], and its flow."""

    path: Path
    run: Run
    velocity: np.ndarray
    flow: Flow


def of(path: Path, words: tuple[str, ...] = ()) -> Side:
    """Averages the second half of the run; `words` go to grain_map. Raises CaseError where the file
    is not one of a chute.
    """
    run = open_chute(path)
    geometry = run.case["geometry"]
    velocity = np.array([mean_velocity(cloud) for cloud in run.clouds])
    start, halves = second_half(velocity)
    one = source.read(path)
    with temporary() as folder:
        span = ["--span", repr(float(run.time[start])), repr(float(run.time[-1]))]
        (profile,) = mapped(
            [one],
            folder / "profile.h5",
            "y",
            *("--walls", "open", "--average", "--spacing", SPACING, *span, *words),
        )[one.name]
    area = geometry["length"] * geometry["thickness"]
    scale = {
        "diameter": run.diameter,
        "density": run.case["grains.density"],
        "height": geometry["height"],
        "area": area,
        "mass": run.mass,
    }
    flow = measure(run.name, profile, halves, gravity_of(geometry), scale)
    if run.attributes.get("end_reason") == "rest":  # whatever it did before
        flow = replace(flow, state="stopped")
    return Side(path, run, velocity, flow)


def open_chute(path: Path) -> Run:
    """Raises CaseError where the file is not one of a chute, or has no second half."""
    run = open_run(path)
    if not is_chute(run.case["geometry"]):
        raise CaseError(f"{path}: no chute (a collapse has no steady flow)")
    if len(run.time) < 3:
        raise CaseError(f"{path}: {len(run.time)} frames (a mean over time takes three or more)")
    return run


def second_half(velocity: np.ndarray) -> tuple[int, tuple[float, float]]:
    """Of the mean velocities (n,) of a run's frames: the first frame of what is averaged, and the
    mean of either half of that [m/s].
    """
    start, end = len(velocity) // 2, len(velocity)
    middle = (start + end) // 2
    return start, (float(velocity[start:middle].mean()), float(velocity[middle:end].mean()))


def mean_velocity(cloud) -> float:
    """Along the flow, of what moves [m/s]."""
    return float((cloud.mass * cloud.v[:, 0]).sum() / cloud.mass.sum())


def units(case: Case) -> dict[str, float]:
    """In which figures show the columns of a flow: g d, sqrt(g d), rho_s g d."""
    d, g, rho = case["grains.diameter"], case["geometry.gravity"], case["grains.density"]
    return {"length": d, "velocity": (g * d) ** 0.5, "rate": (g / d) ** 0.5, "stress": rho * g * d}
