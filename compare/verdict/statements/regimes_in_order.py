import numpy as np

from compare.mapping.reductions import example_run, first_entries
from compare.verdict.statements import Finding, statement


@statement(
    text="Points move from regime 1 to 2 (visco-elasto-plastic), 3 (critical) and 4 (collisional)",
    source="Figure 8",
    unit="of the mass that becomes collisional",
    bound="> 0.5",
    order=12,
)
def regimes_in_order(run):
    """Of the mass that is ever in regime 4, the share whose points were first in 1, then first in
    2, then in 3, then in 4, at the stored frames. A regime that a point passes through between two
    frames is not seen.
    """
    t, mass = first_entries(run), run.clouds[0].mass
    reached = np.isfinite(t[3])
    whole = mass[reached].sum()
    if whole == 0.0:
        return Finding(float("nan"), False, run.tau()[-1], "no point ever becomes collisional")
    ordered = (t[0] < t[1]) & (t[1] < t[2]) & (t[2] < t[3]) & reached
    without = mass[(t[0] < t[1]) & (t[1] < t[3]) & reached].sum() / whole
    medians = ", ".join(
        f"{k + 1}: {np.median(t[k][np.isfinite(t[k])]):.2f}"
        if np.isfinite(t[k]).any()
        else f"{k + 1}: never"
        for k in range(4)
    )
    words = (
        f"{100 * whole / mass.sum():.0f} % of all mass becomes collisional; {without:.2f} of it "
        "passes 1, 2, 4 in this order, whether or not through 3; median first entry of those that "
        f"enter [√(H/g)] {medians}{on_the_way(run, t[3])}"
    )
    return Finding(
        float(mass[ordered].sum() / whole),
        bool(mass[ordered].sum() > 0.5 * whole),
        float(t[3][reached].max()),
        words,
    )


def on_the_way(run, entry) -> str:
    """What kept points from regime 3, which lies below the critical void ratio and takes strain to
    reach: of those that enter 4 at the times `entry`, the share of the mass that was never denser
    before, the share that had lost its contacts (regime 0), and the median strain at the entry.
    """
    states = [cloud.state for cloud in run.clouds]
    if not all({"void_ratio", "deviatoric_strain"} <= state.keys() for state in states):
        return ""
    reached, mass = np.isfinite(entry), run.clouds[0].mass
    before = run.tau()[:, None] < entry[reached]
    at = np.argmin(abs(run.tau()[:, None] - entry[reached]), axis=0)
    e, strain, regime = (
        np.array([state[name] for state in states])[:, reached]
        for name in ("void_ratio", "deviatoric_strain", "regime")
    )
    dense = (before & (e < run.case["material.critical_void_ratio"])).any(axis=0)
    torn = (before & (regime == 0)).any(axis=0)
    share = mass[reached] / mass[reached].sum()
    median = np.median(strain[at, np.arange(reached.sum())])
    return (
        f"; before it {share[~dense].sum():.2f} was never denser than e_c, {share[torn].sum():.2f} "
        f"had lost its contacts (regime 0); median strain at the entry {median:.3f}"
    )


def passing(path):
    """Nine points that go through the regimes of `path`, one per frame, each a frame later than the
    one before.
    """
    regimes = np.array(
        [
            [path[min(max(frame - point, 0), len(path) - 1)] for point in range(9)]
            for frame in range(14)
        ]
    )
    time = np.arange(14.0)
    run = example_run(
        x=np.zeros((14, 9, 3)),
        time=time,
        energy={"time": time, "potential": 20.0 - time},
        engine="mpm",
    )
    for cloud, now in zip(run.clouds, regimes):
        cloud.state["regime"] = now
    return run


def holding():
    return passing([1, 2, 3, 4])


def failing():
    return passing([1, 4, 3, 2])
