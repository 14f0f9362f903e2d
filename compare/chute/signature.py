"""What studies keep of a steady flow, its profiles over the depth, small enough for a text file;
and how far one flow is from another.
"""

from pathlib import Path

import numpy as np

from cases.case import Case
from compare.chute import sides
from compare.chute.flow import CORE
from compare.chute.words import WORDS as FIGURES
from compare.mapping.runs import seconds_of
from compare.study.measure import Measure, scattered
from compare.study.signature import digits

PROFILES = ("solid_fraction", "velocity", "temperature")
LEAST = 0.02  # solid fraction below which nothing of a profile is kept: grains in the air
WORDS = {
    "velocity": "velocity over the depth",
    "mean_velocity": "mean velocity",
    "solid_fraction": "solid fraction of the core",
    "temperature": "granular temperature of the core (of laws that have one)",
}


def compact(path: Path) -> dict:
    """Of a result file: place y [d]; solid fraction, velocity [m/s] and granular temperature
    [m2/s2] there, NaN as None; figures of the core (compare/chute/words.py); state; cost.
    """
    side = sides.of(path)
    flow, run = side.flow, side.run
    there = flow.columns["solid_fraction"] > LEAST
    return {
        "engine": run.engine,
        "seed": int(run.attributes["seed"]),
        "state": flow.state,
        "end_reason": str(run.attributes.get("end_reason", "")),
        "tau": digits([0.0, run.tau()[-1]]),
        "y": digits(flow.y[there] / run.diameter),
        **{name: known(flow.columns[name][there]) for name in PROFILES},
        "figures": {name: known([flow.figures[name]])[0] for name in FIGURES},
        "cpu_seconds": float(
            run.attributes.get("cpu_seconds_collapse", run.attributes.get("cpu_seconds", np.nan))
        ),
        "cpu_seconds_engine": seconds_of(run, "cpu_seconds_engine"),
        "commit": str(run.attributes.get("commit", "unknown")),
        "warnings": str(run.attributes.get("warnings", "none")),
    }


def known(values) -> list[float | None]:
    """Of four digits; None, which JSON has, for NaN, which it has not."""
    return [float(f"{value:.4g}") if np.isfinite(value) else None for value in values]


def column(signature: dict, name: str) -> np.ndarray:
    return np.array(signature[name], dtype=float)  # None becomes NaN


def figure(signature: dict, name: str) -> float:
    value = signature["figures"][name]
    return np.nan if value is None else float(value)


def mean(signatures: list[dict], _scene: Case) -> dict:
    """Of an ensemble: of the profiles at the places of the first, of the figures of the core. It is
    steady where all are.
    """
    first = signatures[0]
    y = column(first, "y")
    profiles = {
        name: known(np.mean([at(one, name, y) for one in signatures], axis=0)) for name in PROFILES
    }
    figures = {
        name: known([np.mean([figure(one, name) for one in signatures])])[0] for name in FIGURES
    }
    states = {one["state"] for one in signatures}
    state = first["state"] if len(states) == 1 else "not all steady"
    return first | profiles | {"figures": figures, "state": state}


def at(signature: dict, name: str, y: np.ndarray) -> np.ndarray:
    """A profile at places y [d]; zero solid, and the last velocity, beyond its ends."""
    beyond = {"left": 0.0, "right": 0.0} if name == "solid_fraction" else {}
    return np.interp(y, column(signature, "y"), column(signature, name), **beyond)


def errors(signature: dict, reference: dict, _scene: Case) -> dict[str, float]:
    """How far a steady flow is from a reference, each relative to the reference's own: of the
    velocity the mean |v - v_ref| of its solid, of mean velocity, solid fraction and granular
    temperature of the core the difference. All NaN where the flow is not steady: then no mean over
    time is a state of its law.
    """
    if signature["state"] != "steady" or reference["state"] != "steady":
        return dict.fromkeys(WORDS, float("nan"))
    y, solid = column(reference, "y"), column(reference, "solid_fraction")
    v = column(reference, "velocity")
    velocity = (solid * abs(at(signature, "velocity", y) - v)).sum() / (solid * v).sum()

    def off(name: str) -> float:
        return abs(figure(signature, name) / figure(reference, name) - 1.0)

    return {
        "velocity": float(velocity),
        "mean_velocity": off("mean_velocity"),
        "solid_fraction": off("solid_fraction"),
        "temperature": abs(heat(signature) / heat(reference) - 1.0),
    }


def heat(signature: dict) -> float:
    """Mean granular temperature of the core [m2/s2]; NaN of a law without one."""
    y, depth = column(signature, "y"), figure(signature, "depth")
    core = (y > CORE[0] * depth) & (y < CORE[1] * depth)
    return float(column(signature, "temperature")[core].mean()) if core.any() else float("nan")


def spread(signatures: list[dict], _scene: Case) -> dict[str, dict]:
    return scattered({name: [figure(one, name) for one in signatures] for name in FIGURES})


STEADY_FLOW = Measure(WORDS, "velocity", "compare.chute.point", compact, mean, errors, spread)
