from compare.metrics import metric
from compare.mapping.reductions import equivalent_height, example_run, last_above


@metric(unit="L0", source="last x where the deposit is a grain deep")
def run_out_height(run):
    """(x - L0)/L0 at the end, x being the last place where the deposit's equivalent height (its
    solid at the bulk's solid fraction) is at least d.
    """
    return (
        last_above(run.fields.grid.x, equivalent_height(run, -1), run.diameter) / run.length - 1.0
    )


def example():
    # Equivalent heights 1, 0.2, 0.0 at x = 0.5, 1.5, 2.5 (bulk 0.5, one row of side 1): 0.1 is
    # crossed at x = 2.
    return (example_run(solid_fraction=[[[0.5, 0.1, 0.0]]]),), 1.0, 1e-12
