from compare.metrics import metric
from compare.mapping.reductions import example_run


@metric(unit="J", source="energy history")
def released_energy(run):
    """Potential energy at release minus potential energy at the end, for the paired mass."""
    return run.released()


def example():
    return (example_run(energy={"time": [0, 1], "potential": [5.0, 2.0]}),), 3.0, 1e-12
