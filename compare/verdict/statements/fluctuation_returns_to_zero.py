import numpy as np

from compare.mapping.reductions import example_run
from compare.verdict.statements import Finding, statement


@statement(
    text="The kinetic energy of fluctuations rises to a peak, then tends to zero",
    source="Figure 6",
    unit="of its peak",
    bound="≤ 0.01 before and after",
    order=7,
)
def fluctuation_returns_to_zero(run):
    """The larger of its values at release and at the end, over its peak; a hundredth is the width
    of a curve in a figure.
    """
    values, tau = run.joules("fluctuation"), run.energy_tau()
    peak = values.max()
    ends = max(values[0], values[-1]) / peak if peak > 0.0 else np.inf
    return Finding(
        ends, ends <= 0.01, tau[-1], f"the peak comes at {tau[np.argmax(values)]:.2f} √(H/g)"
    )


def fluctuating(values):
    t = np.linspace(0.0, 10.0, 201)
    return example_run(
        energy={"time": t, "potential": 2.0 - t / 10.0, "fluctuation": values(t)}, engine="mpm"
    )


def holding():
    return fluctuating(lambda t: 0.01 * t * np.exp(-t))


def failing():
    """It rises and stays."""
    return fluctuating(lambda t: 0.01 * t / (1.0 + t))
