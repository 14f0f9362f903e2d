import numpy as np

from compare.metrics import metric
from compare.mapping.reductions import example_run


@metric(unit="sqrt(H/g)", source="energy history", margin="compare.margin_time")
def kinetic_energy_peak_time(run):
    """Time of the largest translational kinetic energy: the vertex of the parabola through the
    largest sample and its neighbours.
    """
    t, kinetic = run.energy_tau(), run.joules("kinetic")
    if len(kinetic) < 2:
        return float("nan")
    k = int(np.argmax(kinetic))
    if k in (0, len(kinetic) - 1):
        return float(t[k])
    a, b, _ = np.polyfit(t[k - 1 : k + 2] - t[k], kinetic[k - 1 : k + 2], 2)
    return float(t[k] - b / (2.0 * a)) if a < 0.0 else float(t[k])


def example():
    t = np.arange(0.0, 3.0, 0.25)
    return (example_run(energy={"time": t, "kinetic": 2.0 - (t - 1.1) ** 2}),), 1.1, 1e-10
