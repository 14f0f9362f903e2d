import numpy as np

from compare.metrics import metric
from compare.mapping.reductions import example_run, integral


@metric(unit="-", source="energy histories of both engines", of_pair=True)
def kinetic_energy_distance(mpm, dem):
    """Area between the two histories of the kinetic energy of the mean motion over the area under
    the grains': integral of |E_k,mpm - E_k,dem| dt over integral of E_k,dem dt, to the later end of
    the two; a run that has ended holds its last value.
    """
    if len(dem.energy["time"]) < 2:
        return float("nan")
    tau = np.union1d(mpm.energy_tau(), dem.energy_tau())
    a, b = (np.interp(tau, run.energy_tau(), run.mean_motion()) for run in (mpm, dem))
    under = integral(b, tau)
    return integral(abs(a - b), tau) / under if under > 0.0 else float("nan")


def example():
    # Triangles of height 3 and 2 over the same two seconds: (3 - 2)/2.
    runs = [
        example_run(energy={"time": [0, 1, 2], "kinetic": [0.0, peak, 0.0]}) for peak in (3.0, 2.0)
    ]
    return tuple(runs), 0.5, 1e-12
