from compare.metrics import metric
from compare.mapping.reductions import example_run


@metric(unit="E0", source="energy history; E0 is the energy the grains release")
def unaccounted_energy(run):
    """Energy neither held nor booked as dissipated at the end, over E0: numerical losses of the
    continuum, residual of the grains' audit.
    """
    return float(run.normalised("unaccounted")[-1])


def example():
    run = example_run(energy={"time": [0, 1], "unaccounted": [0.0, 0.02]})
    run.reference_energy = 4.0
    return (run,), 0.005, 1e-12
