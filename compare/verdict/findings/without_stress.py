"""Points of the continuum that fly."""

import numpy as np

from compare.mapping.runs import Run
from compare.verdict.findings import Finding, Severity, check, worst

SHARE = 0.1
MOVING = 0.01  # of sqrt(2 g H)


def flying(run: Run) -> float:
    """Share of what moves that carries no stress: mass of the points in regime 0 over mass of all
    points faster than a hundredth of the fall from the column's height, summed over the frames.
    """
    least = MOVING * np.sqrt(2.0 * run.case["geometry.gravity"] * run.height)
    free = total = 0.0
    for cloud in run.clouds:
        if "regime" not in cloud.state:
            return 0.0
        moves = np.linalg.norm(cloud.v, axis=1) > least
        total += cloud.mass[moves].sum()
        free += cloud.mass[moves & (cloud.state["regime"] == 0)].sum()
    return float(free / total) if total > 0.0 else 0.0


@check(order=80)
def without_stress(c, metrics):
    """Moving points in regime 0: for them no law is at work, they fall as free points do."""
    share, which = worst(c.mpm, flying)
    if share > SHARE:
        yield Finding(
            Severity.NOTE,
            f"{100 * share:.0f} % of what moves in the continuum carries no stress{which}: there "
            "the law says nothing.",
            "See where regime is 0 (grainpair export) before the law is praised or blamed.",
            share,
            SHARE,
            unit="of the moving mass",
            reason="a tenth of the flow is no longer its rim",
            of="mpm",
        )
