from compare.metrics import metric
from compare.mapping.reductions import example_run, surface


@metric(
    unit="L0", source="free surface: solid fraction half the bulk's", margin="compare.margin_height"
)
def final_height(run):
    """Largest height of the free surface at the end, over L0; the surface is where the solid
    fraction, followed up from the floor, falls below half of the bulk's. No single grain decides:
    without the highest one it falls by 0.014 H on average of 16 packings of cases/column_ci, and
    0.029 H at most; the height that holds 99.5 % of the mass by up to 0.033 H, the highest grain
    itself by up to 0.041 H.
    """
    return float(surface(run, -1).max()) / run.length


def example():
    # Bulk 0.5: from 0.5 at y = 1.5 to 0 at y = 2.5 the limit 0.25 is crossed at y = 2.
    return (example_run(solid_fraction=[[[0.5, 0.5], [0.5, 0.0], [0.0, 0.0]]]),), 2.0, 1e-12
