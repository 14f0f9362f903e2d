from compare.metrics import metric
from compare.mapping.reductions import example_run, surface


@metric(unit="A0", source="free-surface profiles, as Lagree et al. compare them", of_pair=True)
def deposit_profile_l1(mpm, dem):
    """Area between the two final free surfaces over the column's initial area A0 = H L0."""
    gap = abs(surface(mpm, -1) - surface(dem, -1)).sum() * dem.fields.grid.spacing
    return gap / (dem.height * dem.length)


def example():
    # Surfaces at 1.0 and 2.0 over one of two columns of width 1: area 1, A0 = 1.
    low = example_run(solid_fraction=[[[0.5, 0.5], [0.0, 0.0], [0.0, 0.0]]])
    high = example_run(solid_fraction=[[[0.5, 0.5], [0.5, 0.0], [0.0, 0.0]]])
    return (low, high), 1.0, 1e-12
