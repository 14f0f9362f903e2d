from compare.metrics import metric
from compare.mapping.reductions import example_run


@metric(
    unit="E0",
    source="energy history; E0 is the energy the grains release",
    margin="compare.margin_energy",
)
def dissipated_energy(run):
    """Energy dissipated by all physical mechanisms until the end, over the energy E0 that the
    grains release. Numerical losses are not in it.
    """
    return float(run.normalised("dissipated")[-1])


def example():
    run = example_run(energy={"time": [0, 1], "dissipated": [0.0, 2.0]})
    run.reference_energy = 4.0
    return (run,), 0.5, 1e-12
