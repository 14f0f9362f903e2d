import numpy as np

from compare.mapping.reductions import example_run, first_entries
from compare.verdict.statements import Finding, statement


@statement(
    text="The transition starts at the surface and spreads to deeper points",
    source="Figure 8",
    unit="of the median depth",
    bound="≤ 0.5",
    order=13,
)
def regimes_from_the_surface(run):
    """Median depth of the tenth of the mass that becomes collisional first, over the median depth
    of all mass; a point's depth is its distance from the column's top or free side at release,
    whichever is less. Points that start anywhere give 1.
    """
    entry, start = first_entries(run)[3], run.clouds[0]
    depth = np.minimum(run.height - start.x[:, 1], run.length - start.x[:, 0])
    order = np.argsort(entry, kind="stable")
    reached = start.mass[np.isfinite(entry)].sum()
    if reached == 0.0:
        return Finding(float("nan"), False, run.tau()[-1], "no point ever becomes collisional")
    cut = entry[order][np.searchsorted(np.cumsum(start.mass[order]), 0.1 * reached)]
    first, later = depth[entry <= cut], depth[np.isfinite(entry) & (entry > cut)]
    ratio = float(np.median(first) / np.median(depth))
    words = f"the first tenth is collisional by {cut:.2f} √(H/g)"
    words += (
        f", at a median depth of {np.median(first) / run.height:.3f} H; those that follow lay "
        f"{np.median(later) / run.height:.3f} H deep"
        if len(later)
        else ""
    )
    return Finding(ratio, ratio <= 0.5, float(cut), words)


def spreading(entry):
    """A block of 20 x 20 points that enter regime 4 at the frame entry(depth)."""
    centres = (np.arange(20) + 0.5) / 20
    x, y = (a.ravel() for a in np.meshgrid(centres, centres))
    frames = entry(np.minimum(1.0 - x, 1.0 - y))
    time = np.arange(12.0)
    run = example_run(
        x=np.repeat(np.stack([x, y, 0.0 * x], axis=-1)[None], 12, axis=0),
        time=time,
        energy={"time": time, "potential": 20.0 - time},
        engine="mpm",
    )
    for k, cloud in enumerate(run.clouds):
        cloud.state["regime"] = np.where(k >= frames, 4, 1)
    return run


def holding():
    return spreading(lambda depth: 1 + np.floor(10.0 * depth))


def failing():
    """Points become collisional wherever they are."""
    return spreading(lambda depth: np.random.default_rng(1).integers(1, 11, len(depth)))
