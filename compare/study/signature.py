"""What studies keep of a run: its final distribution of mass along x, its energy histories, that of
the fluctuations where its fields tell it, and its dissipation in place and time, small enough for
a text file.

A signature expands to a Run again, so that the metrics are those of every other comparison.
"""

import numpy as np

from cases.case import Case
from compare.mapping.dissipation import InPlace, in_place
from compare.mapping.reductions import DENSE, dense_fluctuation
from compare.mapping.clouds import Cloud
from compare.mapping.runs import Run, seconds_of
from compare.metrics.final_height import final_height
from compare.metrics.moving_without_stress import moving_without_stress

# of the quantile function of mass; with the levels of 99 and 99.5 %, a rounding error above them.
# run_out_95 is read at the one above 95 %, 95.1 %, of every run alike.
LEVELS = np.union1d(np.arange(1, 513) / 512, [0.99 + 1e-9, 0.995 + 1e-9])
INTERVAL = 0.05  # of the histories [sqrt(H/g)]
HISTORY = ("kinetic", "fluctuation", "potential", "dissipated", "unaccounted", DENSE)
PARTS = 10**5  # of the dissipation in place: the unit of a cell's share


def compact(run: Run) -> dict:
    """x_k [m], the x within which the share LEVELS[k] of the final mass lies; histories [J] every
    INTERVAL; height [L0] of the free surface, dissipation in place and the share of moving points
    without stress, where they are known; processor time of the engine's own steps, where the file
    tells it, of all but a packing, and of that.
    """
    cloud, tau = run.clouds[-1], run.energy_tau()
    order = np.argsort(cloud.x[:, 0], kind="stable")
    shares = np.cumsum(cloud.mass[order]) / cloud.mass.sum()
    x = cloud.x[order, 0][np.searchsorted(shares, LEVELS - 2e-9).clip(0, len(order) - 1)]
    times = np.append(np.arange(0.0, tau[-1], INTERVAL), tau[-1])
    steps, engine = run.attributes["steps"], seconds_of(run, "cpu_seconds_engine")
    history = {
        name: np.interp(times, tau, run.energy[name]) for name in HISTORY if name in run.energy
    }
    dense = dense_fluctuation(run)
    if dense is not None and dense[1].any():  # not of a law that knows no temperature
        history[DENSE] = np.interp(times, *dense)
    gone, free = in_place(run), moving_without_stress(run)
    return {
        "engine": run.engine,
        "seed": int(run.attributes["seed"]),
        "mass": float(run.mass),
        "x": digits(x),
        "tau": digits(times),
        **{name: digits(values) for name, values in history.items()},
        **({"height": float(f"{final_height(run):.4g}")} if run.mapped else {}),
        **({"dissipation": packed(gone)} if gone else {}),
        **({"moving_without_stress": float(f"{free:.4g}")} if np.isfinite(free) else {}),
        "steps": int(steps),
        **({"cpu_seconds_engine": engine} if np.isfinite(engine) else {}),
        "cpu_seconds": float(
            run.attributes.get("cpu_seconds_collapse", run.attributes["cpu_seconds"])
        ),
        "cpu_seconds_packing": float(run.attributes.get("cpu_seconds_packing", 0.0)),
        "end_reason": str(run.attributes["end_reason"]),
        "commit": str(run.attributes.get("commit", "unknown")),
        "warnings": str(run.attributes.get("warnings", "none")),
    }


def digits(values) -> list[float]:
    return [float(f"{value:.4g}") for value in values]


def packed(gone: InPlace) -> dict:
    """The total [J]; the least i, j, k of the cells and how many j and k there are; for each cell
    that holds any, how far it is behind the one before, and its share in PARTS of the total.
    """
    low = gone.cells.min(axis=0)
    size = gone.cells.max(axis=0) - low + 1
    index = np.ravel_multi_index(tuple((gone.cells - low).T), tuple(size))
    share = np.rint(PARTS * gone.joules / gone.total).astype(int)
    some = share != 0
    return {
        "total": float(f"{gone.total:.6g}"),
        "low": low.tolist(),
        "size": size.tolist(),
        "behind": np.diff(index[some], prepend=0).tolist(),
        "share": share[some].tolist(),
    }


def unpacked(kept: dict) -> InPlace:
    """The total stays what it was: rounding the shares does not take from it."""
    index = np.unravel_index(np.cumsum(kept["behind"]), kept["size"])
    share = np.array(kept["share"], dtype=float)
    return InPlace(np.stack(index, axis=1) + kept["low"], kept["total"] * share / share.sum())


def expand(signature: dict, scene: Case) -> Run:
    """The run of a signature, of the scene `scene`: one cloud, the last, along x. One that was kept
    before dissipation in place was has none.
    """
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
        dissipation=unpacked(signature["dissipation"]) if "dissipation" in signature else None,
    )
