import numpy as np

from compare.metrics import metric
from compare.mapping.reductions import bulk_solid_fraction, example_run, stress

BELOW_SURFACE = 3  # cells of the map: nearer to the surface the kernel reaches into the air
CUBIC = [(i, j) for i in range(4) for j in range(4 - i)]


@metric(unit="-", source="root mean square residual of a cubic least-squares fit")
def pressure_roughness(run):
    """Root mean square of p minus its cubic fit in x and y, over the mean of p, at the last
    instant, p = trace(sigma)/3 mapped with the common kernel, in the cells of x < L0 with more than
    half of the bulk's solid fraction whose three upper neighbours have it too. Grains at rest are
    rough themselves, by their force chains; a continuum has no such excuse.
    """
    solid = run.fields["solid_fraction"][-1] > 0.5 * bulk_solid_fraction(run)
    covered = solid.copy()
    for rows in range(1, BELOW_SURFACE + 1):
        covered[:-rows] &= solid[rows:]
        covered[-rows:] = False
    x, y = np.meshgrid(run.fields.grid.x / run.length, run.fields.grid.y / run.length)
    p = np.trace(stress(run, len(run.fields.time) - 1), axis1=-2, axis2=-1) / 3
    inside = covered & (x < 1.0) & np.isfinite(p)
    if inside.sum() <= len(CUBIC) or not p[inside].mean() > 0.0:
        return float("nan")
    basis = np.stack([x[inside] ** i * y[inside] ** j for i, j in CUBIC], axis=1)
    fitted = basis @ np.linalg.lstsq(basis, p[inside], rcond=None)[0]
    return float(np.sqrt(np.mean((p[inside] - fitted) ** 2)) / p[inside].mean())


def example():
    # Cells that alternate by a tenth about a constant pressure: no cubic follows that.
    n = 40
    sign = (-1.0) ** np.add.outer(np.arange(n), np.arange(n))
    p = (1.0 + 0.1 * sign)[None, :, :, None, None] * np.eye(3)
    run = example_run(solid_fraction=np.full((1, n, n), 0.5), stress_state=p, spacing=0.02)
    return (run,), 0.1, 1e-3  # what is left of the alternation on 40 cells after the fit
