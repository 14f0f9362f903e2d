"""Dissipation in place and time, for either engine on the same coarse partition.

What the contacts of a grain, or a material point in all its accounts, dissipates
between two frames is booked at the point's place halfway between them, evenly over the time from
one to the other. It is summed over cells of a fifth of the column's length, height and time scale.

The size of the cells decides little: the distances (metric dissipation_distance) of four laws and
two packings from a third packing of cases/column_ci, 0.08 to 0.44, change by 1.3 % at most from
fifths to fiftieths, and by 4 % to two fifths. Differences cell by cell do not converge like that:
between packings half their sum grows from 0.24 to 0.66 as cells shrink from fifths to twentieths.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compare.mapping.runs import Run

CELL = 0.2  # side of the cells [L0], [H], [sqrt(H/g)]


@dataclass(frozen=True)
class InPlace:
    """cells (n, 3): whole numbers i, j, k of the cells that start at (i, j, k) times CELL;
    joules (n,): dissipated there [J].
    """

    cells: np.ndarray
    joules: np.ndarray

    @property
    def total(self) -> float:
        """[J]"""
        return float(self.joules.sum())

    @property
    def places(self) -> np.ndarray:
        """Centres of the cells (n, 3) [L0, H, sqrt(H/g)]."""
        return (self.cells + 0.5) * CELL

    def times(self, factor: float) -> "InPlace":
        return InPlace(self.cells, factor * self.joules)


def gathered(cells: np.ndarray, joules: np.ndarray) -> InPlace:
    """Each cell once, in order, with the sum of what is told of it."""
    cells, inverse = np.unique(cells, axis=0, return_inverse=True)
    return InPlace(cells, np.bincount(inverse.ravel(), joules, len(cells)))


def mean(parts: Sequence[InPlace]) -> InPlace:
    """Of several runs, cell by cell."""
    cells, joules = ([getattr(part, name) for part in parts] for name in ("cells", "joules"))
    return gathered(np.concatenate(cells), np.concatenate(joules) / len(parts))


def in_place(run: Run) -> InPlace | None:
    """Of a run, not scaled by mass; None where its frames do not tell it."""
    if run.dissipation is None and len(run.clouds) > 1:
        run.dissipation = of_frames(run)
    return run.dissipation


def of_frames(run: Run) -> InPlace | None:
    """None where a frame lacks the record `dissipated`, or points of the frame before."""
    tau, walls = run.tau(), at_walls(run)
    found: list[tuple[np.ndarray, np.ndarray]] = []
    before = None
    for frame, cloud in enumerate(run.clouds):
        gone = cloud.state.get("dissipated")
        if gone is None or before is not None and len(gone) != len(before[1]):
            return None
        if before is not None:
            joules = gone - before[1] + walls[frame] * floor_shares(run, cloud)
            middle = (cloud.x[:, :2] + before[0]) / 2.0 / (run.length, run.height)
            found.append(spread(middle, joules, tau[frame - 1], tau[frame]))
        before = cloud.x[:, :2], gone
    return gathered(*(np.concatenate(parts) for parts in zip(*found)))


def spread(places: np.ndarray, joules: np.ndarray, start: float, end: float):
    """Cells and joules of what is dissipated at places (n, 2) [L0, H] evenly from `start` to `end`
    [sqrt(H/g)].
    """
    plane = gathered(np.floor(places / CELL).astype(int), joules)
    periods = np.arange(int(start / CELL), int(np.ceil(end / CELL)))
    overlap = np.minimum(end, (periods + 1) * CELL) - np.maximum(start, periods * CELL)
    shares = np.maximum(overlap, 0.0) / (end - start)
    cells = [np.insert(plane.cells, 2, period, axis=1) for period in periods]
    return np.concatenate(cells), np.outer(shares, plane.joules).ravel()


def at_walls(run: Run) -> np.ndarray:
    """What the continuum's walls dissipated up to each frame since the one before [J]; zero for
    grains, whose contacts with walls are in their own records.
    """
    if run.engine != "mpm" or "dissipated_wall" not in run.energy:
        return np.zeros(len(run.time))
    total = np.interp(run.time, run.energy["time"], run.energy["dissipated_wall"])
    return np.diff(total, prepend=total[0])


def floor_shares(run: Run, cloud) -> np.ndarray:
    """The share (n,) of each point in what walls dissipate, which the points do not know: by
    momentum, in the cells along the floor.
    """
    low = cloud.x[:, 1] < CELL * run.height
    momentum = np.where(low, cloud.mass * np.linalg.norm(cloud.v, axis=1), 0.0)
    total = momentum.sum()
    return momentum / total if total > 0.0 else momentum
