import numpy as np

from compare.metrics import metric
from compare.mapping.reductions import example_run, mass_quantile


@metric(
    unit="L0",
    source="mass percentile, defined alike for grains and material points",
    margin="compare.margin_run_out",
    decides=False,
)
def run_out(run):
    """(x_99.5 - L0)/L0 at the end, x_99.5 being the x within which 99.5 % of the mass lies. The
    farthest half per cent is stray grains: between packings it scatters three to eight times as
    much as run_out_95, so its verdict does not enter the overall one.
    """
    cloud = run.clouds[-1]
    return mass_quantile(cloud.x[:, 0], cloud.mass, 0.995) / run.length - 1.0


def example():
    # Two hundred points at 0.01, 0.02, ... 2.00: the 199th reaches 99.5 %.
    x = np.zeros((1, 200, 3))
    x[0, :, 0] = 0.01 * np.arange(1, 201)
    return (example_run(x=x),), 0.99, 1e-12
