import numpy as np

from compare.metrics import metric
from compare.mapping.reductions import example_run, wasserstein


@metric(
    unit="L0",
    source="optimal transport in one dimension: integral of |F_mpm - F_dem| over x",
    of_pair=True,
    margin="compare.margin_distance",
)
def wasserstein_x(mpm, dem):
    """Mean distance along x that mass would have to be moved to turn one final deposit into the
    other, over L0.
    """
    a, b = mpm.clouds[-1], dem.clouds[-1]
    return wasserstein(a.x[:, 0], b.x[:, 0], a.mass, b.mass) / dem.length


def example():
    # The same two points, shifted by 0.3.
    x = np.zeros((1, 2, 3))
    x[0, 1, 0] = 1.0
    return (example_run(x=x), example_run(x=x + [0.3, 0.0, 0.0])), 0.3, 1e-12
