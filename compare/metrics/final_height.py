from compare.metrics import metric
from compare.mapping.reductions import example_run, surface


@metric(
    unit="L0", source="free surface: solid fraction half the bulk's", margin="compare.margin_height"
)
def final_height(run):
    """Largest height of the free surface at the end, over L0; the surface is where the solid
    fraction, followed up from the floor, falls below half of the bulk's.
    """
    return float(surface(run, -1).max()) / run.length


def example():
    # Bulk 0.5: from 0.5 at y = 1.5 to 0 at y = 2.5 the limit 0.25 is crossed at y = 2.
    return (example_run(solid_fraction=[[[0.5, 0.5], [0.5, 0.0], [0.0, 0.0]]]),), 2.0, 1e-12
