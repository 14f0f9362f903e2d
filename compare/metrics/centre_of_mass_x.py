import numpy as np

from compare.metrics import metric
from compare.mapping.reductions import example_run


@metric(
    unit="L0",
    source="first moment of mass; it differs by no more than wasserstein_x does",
    margin="compare.margin_distance",
)
def centre_of_mass_x(run):
    """x of the centre of mass at the end, over L0."""
    cloud = run.clouds[-1]
    return float(np.average(cloud.x[:, 0], weights=cloud.mass)) / run.length


def example():
    x = np.zeros((1, 4, 3))
    x[0, :, 0] = [0.0, 1.0, 2.0, 5.0]
    return (example_run(x=x),), 2.0, 1e-12
