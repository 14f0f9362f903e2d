from compare.metrics import metric
from compare.mapping.reductions import example_run


@metric(unit="kg", source="coarse-grained density")
def mapped_mass(run):
    """Integral of the mapped density over the grid at release; must equal the mass."""
    return run.mass_scale * float(run.fields.grid.integral(run.fields["density"][0]))


def example():
    return (example_run(solid_fraction=[[[1.0, 2.0], [3.0, 4.0]]], spacing=0.5),), 2.5, 1e-12
