from compare.metrics import metric
from compare.mapping.reductions import example_run


@metric(
    unit="E0",
    source="energy history; E0 is the energy the grains release",
    margin="compare.margin_energy",
)
def kinetic_energy_peak(run):
    """Largest translational kinetic energy of the mean motion, over the energy E0 that the grains
    release; the fluctuations of the grains are not in it, as they are not in the continuum's.
    """
    return float(run.mean_motion().max())


def example():
    held = {"kinetic": [0.0, 3.5, 1.0], "fluctuation": [0.0, 0.5, 0.2]}
    run = example_run(energy={"time": [0, 1, 2]} | held)
    run.reference_energy = 10.0
    return (run,), 0.3, 1e-12
