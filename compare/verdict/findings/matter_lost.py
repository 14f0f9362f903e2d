"""Matter that is there in one frame and not in another."""

import numpy as np

from compare.mapping.runs import Run
from compare.verdict.findings import SIDE, Finding, Severity, check, sides, worst


def lost(run: Run) -> float:
    """Share of the points at release that the emptiest frame lacks."""
    counts = [len(cloud.mass) for cloud in run.clouds]
    return 1.0 - min(counts) / counts[0]


def not_finite(run: Run) -> float:
    """Share of the points of the last frame without a place."""
    return float(np.mean(~np.isfinite(run.clouds[-1].x).all(axis=1)))


@check(order=30)
def matter_lost(c, metrics):
    """Grains or material points that a later frame no longer holds, or holds without a place: mass,
    momentum and energy went with them.
    """
    for engine, runs in sides(c):
        for figure, words in ((lost, "are gone from a later frame"), (not_finite, "have no place")):
            share, which = worst(runs, figure)
            if share > 0.0:
                advice = f"Lower {engine}.time_step_fraction."
                if engine == "dem" and any(run.imported for run in runs):
                    advice = (
                        "Have all of them written; their energy stands as lost, not dissipated."
                    )
                yield Finding(
                    Severity.INVALID,
                    f"{100 * share:.2g} % of the points of the {SIDE[engine]} {words}{which}.",
                    advice,
                    share,
                    0.0,
                    reason="mass is conserved",
                    of=engine,
                )
