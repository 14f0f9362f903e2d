import numpy as np

from compare.metrics import metric
from compare.mapping.reductions import crossing_time, example_run, front


@metric(unit="sqrt(H/g)", source="front x_99.5 of the frames, linear in between")
def run_out_t95(run):
    """Time at which the front x_99.5 has covered 95 % of its way."""
    x = front(run)
    return crossing_time(run.tau(), x, x[0] + 0.95 * (x[-1] - x[0]))


def example():
    # One point at x = t^2 at t = 0, 1, 2: 95 % of 4 is 3.8, passed at 1 + 2.8/3.
    x = np.zeros((3, 1, 3))
    x[:, 0, 0] = [0.0, 1.0, 4.0]
    return (example_run(x=x, time=(0.0, 1.0, 2.0)),), 1.0 + 2.8 / 3.0, 1e-12
