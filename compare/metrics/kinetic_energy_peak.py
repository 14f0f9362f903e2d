from compare.metrics import metric
from compare.mapping.reductions import example_run


@metric(
    unit="E0",
    source="energy history; E0 is the energy the grains release",
    margin="compare.margin_energy",
)
def kinetic_energy_peak(run):
    """Largest translational kinetic energy, over the energy E0 that the grains release."""
    return float(run.normalised("kinetic").max())


def example():
    run = example_run(energy={"time": [0, 1, 2], "kinetic": [0.0, 3.0, 1.0]})
    run.reference_energy = 10.0
    return (run,), 0.3, 1e-12
