import numpy as np

from compare.metrics import metric
from compare.mapping.reductions import example_run, mass_quantile


@metric(
    unit="L0",
    source="mass percentile, defined alike for grains and material points",
    margin="compare.margin_run_out",
)
def run_out_95(run):
    """(x_95 - L0)/L0 at the end, x_95 being the x within which 95 % of the mass lies."""
    cloud = run.clouds[-1]
    return mass_quantile(cloud.x[:, 0], cloud.mass, 0.95) / run.length - 1.0


def example():
    # Two hundred points at 0.01, 0.02, ... 2.00: the 190th reaches 95 %.
    x = np.zeros((1, 200, 3))
    x[0, :, 0] = 0.01 * np.arange(1, 201)
    return (example_run(x=x),), 0.90, 1e-12
