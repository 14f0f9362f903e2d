import numpy as np

from compare.metrics import metric
from compare.mapping.reductions import example_run


@metric(unit="sqrt(H/g)", source="energy history")
def stop_time(run):
    """Time after which the kinetic energy stays below a thousandth of its peak; undefined while it
    has not.
    """
    t, kinetic = run.energy_tau(), run.joules("kinetic")
    moving = np.flatnonzero(kinetic >= 1e-3 * kinetic.max())
    return float(t[moving[-1] + 1]) if moving[-1] + 1 < len(t) else float("nan")


def example():
    return (
        (example_run(energy={"time": [0, 1, 2, 3], "kinetic": [0.0, 1.0, 0.1, 0.0005]}),),
        3.0,
        1e-12,
    )
