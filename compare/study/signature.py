"""What studies keep of a run: its final distribution of mass along x and its energy histories,
small enough for a text file.

A signature expands to a Run again, so that the metrics are those of every other comparison.
"""

import numpy as np

from cases.case import Case
from compare.mapping.runs import Cloud, Run

# of the quantile function of mass; with the levels that run-outs are read at, a rounding error
# above them
LEVELS = np.union1d(np.arange(1, 513) / 512, [0.99 + 1e-9, 0.995 + 1e-9])
INTERVAL = 0.05  # of the histories [sqrt(H/g)]
HISTORY = (
    "kinetic",
    "potential",
    "dissipated",
    "dissipated_regime_4",
    "dissipated_short",
    "unaccounted",
)


def compact(run: Run) -> dict:
    """x_k [m], the x within which the share LEVELS[k] of the final mass lies; histories [J] every
    INTERVAL; the run's cost.
    """
    cloud, tau = run.clouds[-1], run.energy_tau()
    order = np.argsort(cloud.x[:, 0], kind="stable")
    shares = np.cumsum(cloud.mass[order]) / cloud.mass.sum()
    x = cloud.x[order, 0][np.searchsorted(shares, LEVELS - 2e-9).clip(0, len(order) - 1)]
    times = np.append(np.arange(0.0, tau[-1], INTERVAL), tau[-1])
    steps, cpu = run.attributes["steps"], run.attributes.get(
        "cpu_seconds_collapse", run.attributes["cpu_seconds"]
    )
    history = {
        name: np.interp(times, tau, run.energy[name]) for name in HISTORY if name in run.energy
    }
    return {
        "engine": run.engine,
        "seed": int(run.attributes["seed"]),
        "mass": float(run.mass),
        "x": digits(x),
        "tau": digits(times),
        **{name: digits(values) for name, values in history.items()},
        "steps": int(steps),
        "cpu_seconds": float(cpu),
        "cpu_seconds_packing": float(run.attributes.get("cpu_seconds_packing", 0.0)),
        "end_reason": str(run.attributes["end_reason"]),
        "commit": str(run.attributes.get("commit", "unknown")),
        "warnings": str(run.attributes.get("warnings", "none")),
    }


def digits(values) -> list[float]:
    return [float(f"{value:.4g}") for value in values]


def expand(signature: dict, scene: Case) -> Run:
    """The run of a signature, of the scene `scene`: one cloud, the last, along x."""
    x = np.zeros((len(LEVELS), 3))
    x[:, 0] = signature["x"]
    mass = signature["mass"] * np.diff(LEVELS, prepend=0.0)
    scale = np.sqrt(scene["geometry.height"] / scene["geometry.gravity"])
    energy = {name: np.array(signature[name]) for name in HISTORY if name in signature}
    energy["time"] = scale * np.array(signature["tau"])
    return Run(
        signature["engine"],
        signature["engine"],
        scene,
        energy["time"][-1:],
        [Cloud(x, np.zeros_like(x), mass, mass / scene["grains.density"])],
        energy,
        signature,
    )
