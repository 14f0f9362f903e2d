import numpy as np

from compare.mapping.reductions import example_run
from compare.verdict.statements import Finding, statement

SMALL = 0.05  # accumulated deviatoric strain


@statement(
    text=(
        "A failure surface bounds a static cone with small strains, bottom left, under a "
        "mobilised mass"
    ),
    source="Figure 3",
    unit="of the mass",
    bound="0.05 to 0.95, below and left of the rest",
    order=10,
)
def static_cone(run):
    """Share of the mass whose accumulated deviatoric strain stays below 0.05 to the end. There is a
    cone when that is neither nothing nor everything, to a twentieth, and its centre in the column
    at release lay below and left of the rest's.
    """
    start, end = run.clouds[0], run.clouds[-1]
    small = end.state["deviatoric_strain"] < SMALL
    share = float(end.mass[small].sum() / end.mass.sum())
    if not 0.0 < share < 1.0:
        return Finding(share, False, run.tau()[-1])
    centre, rest = (
        np.average(start.x[part, :2], axis=0, weights=start.mass[part]) for part in (small, ~small)
    )
    off = (centre - rest) / [run.length, run.height]
    words = (
        f"its centre lay {-off[0]:.2f} L0 left of the rest's and {-off[1]:.2f} H below it; median "
        f"strain elsewhere {np.median(end.state['deviatoric_strain'][~small]):.2f}"
    )
    return Finding(share, 0.05 <= share <= 0.95 and bool((off < 0.0).all()), run.tau()[-1], words)


def straining(static):
    """A block of 20 x 20 points, strained by one except where static(x, y)."""
    centres = (np.arange(20) + 0.5) / 20
    x, y = (a.ravel() for a in np.meshgrid(centres, centres))
    run = example_run(x=np.stack([x, y, 0.0 * x], axis=-1)[None], engine="mpm")
    run.clouds[0].state["deviatoric_strain"] = np.where(static(x, y), 0.0, 1.0)
    return run


def holding():
    return straining(lambda x, y: x + y < 0.6)


def failing():
    """What does not strain lies on top."""
    return straining(lambda x, y: x + (1.0 - y) < 0.6)
