import numpy as np

from compare.metrics import metric
from compare.mapping.reductions import bulk_solid_fraction, example_run

MOVING = 0.01  # of sqrt(2 g H), the fall from the column's height
NONE = 0.01  # of the pressure under one layer of grains; between 1e-4 and 1e-2 of it lies, of four
# laws in cases/column_ci, at most 1.5 % of what moves


@metric(unit="moving mass", source="stress and velocity of the material points")
def moving_without_stress(run):
    """Mass of the moving points that carry no stress over the mass of all that move, summed over
    the frames: points faster than a hundredth of sqrt(2 g H), and of those the points whose stress
    (Frobenius norm, as the grid feels it) is below a hundredth of rho_b g d, rho_b the bulk's
    density. There no law is at work, whichever it is: they fall as free points do. Of the continuum
    alone; undefined where nothing moves.
    """
    gravity = run.case["geometry.gravity"]
    least = MOVING * np.sqrt(2.0 * gravity * run.height)
    bulk = run.case["grains.density"] * bulk_solid_fraction(run)
    free = total = 0.0
    for cloud in run.clouds:
        if "stress" not in cloud.state:
            return float("nan")
        moves = np.linalg.norm(cloud.v, axis=1) > least
        loose = cloud.state["stress"] < NONE * bulk * gravity * run.diameter
        total += cloud.mass[moves].sum()
        free += cloud.mass[moves & loose].sum()
    return float(free / total) if total > 0.0 else float("nan")


def example():
    # Bulk density 0.5, d = 0.1, g = 1: the limit is 5e-4. Of four points one does not move, and one
    # of the other three is below it.
    v = np.ones((1, 4, 3))
    v[0, 3] = 0.0
    stress = [[4e-4, 6e-4, 1.0, 0.0]]
    return (example_run(v=v, x=0.0 * v, state={"stress": stress}),), 1.0 / 3.0, 1e-12
