"""Grains that lie denser than grains can."""

import numpy as np

from compare.mapping.runs import Run
from compare.verdict.findings import Finding, Severity, check, worst

DENSEST = 0.75
BESIDE_WALLS = 1.0  # [d] layers order there, and lie between the grains of a rough base


def densest(run: Run) -> float:
    """Largest mapped solid fraction over the frames, mean of 3 × 3 cells, farther than a diameter
    from floor and left wall.
    """
    if run.mapped is None:
        return 0.0
    x, y = run.fields.grid.x, run.fields.grid.y
    inside = np.ix_(y > BESIDE_WALLS * run.diameter, x > BESIDE_WALLS * run.diameter)
    most = 0.0
    for phi in run.fields["solid_fraction"]:
        part = phi[inside]
        if min(part.shape) >= 3:
            windows = np.lib.stride_tricks.sliding_window_view(part, (3, 3))
            most = max(most, float(windows.mean(axis=(2, 3)).max()))
    return most


@check(order=92)
def too_dense(c, metrics):
    """Largest solid fraction of the grains away from walls: equal spheres reach 0.7405 at most, so
    more means that they overlap, or that radii or places are not what they are said to be.
    """
    solid, which = worst(c.dem, densest)
    if solid > DENSEST:
        yield Finding(
            Severity.CAUTION,
            f"The grains fill {solid:.2f} of the space{which}: no packing of equal spheres does.",
            "See whether radii, units and thickness are right.",
            solid,
            DENSEST,
            reason="the densest packing of equal spheres fills 0.7405",
            of="dem",
        )
