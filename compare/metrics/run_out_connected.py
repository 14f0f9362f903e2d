import numpy as np

from compare.metrics import metric
from compare.mapping.reductions import example_run, main_mass


@metric(
    unit="L0",
    source=(
        "farthest grain still connected to the main mass, on the mapped field so that points have "
        "it too"
    ),
)
def run_out_connected(run):
    """(x - L0)/L0 at the end, x being the far side of the heaviest connected region whose solid
    fraction exceeds 5 % of the bulk's.
    """
    grid = run.fields.grid
    columns = np.flatnonzero(main_mass(run, -1).any(axis=0))
    if not len(columns):
        return float("nan")
    return (grid.x[columns[-1]] + 0.5 * grid.spacing) / run.length - 1.0


def example():
    # Five full cells of side 0.5, a gap, and one cell beyond it: connected mass ends at 2.5.
    return (example_run(solid_fraction=[[[0.5] * 5 + [0.0] + [0.5]]], spacing=0.5),), 1.5, 1e-12
