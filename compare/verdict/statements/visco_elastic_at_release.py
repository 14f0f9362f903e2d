import numpy as np

from compare.mapping.reductions import example_run
from compare.verdict.statements import Finding, statement


@statement(
    text="At first all points are in the visco-elastic regime (1)",
    source="Figure 8",
    unit="of the mass",
    bound="= 1",
    order=11,
)
def visco_elastic_at_release(run):
    """Share of the mass in regime 1 at the instant of release."""
    cloud = run.clouds[0]
    share = float(cloud.mass[cloud.state["regime"] == 1].sum() / cloud.mass.sum())
    return Finding(share, bool((cloud.state["regime"] == 1).all()), 0.0)


def starting(regimes):
    run = example_run(
        x=np.zeros((1, len(regimes), 3)),
        engine="mpm",
        energy={"time": [0.0, 1.0], "potential": [1.0, 0.0]},
    )
    run.clouds[0].state["regime"] = np.array(regimes)
    return run


def holding():
    return starting([1, 1, 1, 1])


def failing():
    return starting([1, 1, 1, 2])
