from compare.metrics import metric
from compare.mapping.reductions import example_run, surface


@metric(
    unit="d",
    source="free-surface profiles; one to two grains is what Lagree et al. call agreement",
    of_pair=True,
)
def deposit_profile_linf(mpm, dem):
    """Largest vertical distance between the two final free surfaces, in grain diameters."""
    return float(abs(surface(mpm, -1) - surface(dem, -1)).max()) / dem.diameter


def example():
    # Surfaces at 1.0 and 2.0, d = 0.1.
    low = example_run(solid_fraction=[[[0.5, 0.5], [0.0, 0.0], [0.0, 0.0]]])
    high = example_run(solid_fraction=[[[0.5, 0.5], [0.5, 0.0], [0.0, 0.0]]])
    return (low, high), 10.0, 1e-10
