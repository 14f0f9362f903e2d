import numpy as np

from compare.metrics import metric
from compare.mapping.reductions import dense_fluctuation, example_run, integral


@metric(unit="-", source="mapped fields of both sides, the same cells' rule", of_pair=True)
def granular_temperature_distance(mpm, dem):
    """Area between the two histories of the granular temperature summed over what is dense,
    integral of 3/2 rho T over the cells with more than half of the bulk's solid fraction, over the
    area under the grains'; T as for granular_temperature_error. The engines' own accounts
    `fluctuation` are not one quantity: the continuum's counts every point, a free one too, the
    grains' only cells of 3 d that hold eight. Undefined for a law without granular temperature.
    """
    ours, theirs = dense_fluctuation(mpm), dense_fluctuation(dem)
    if ours is None or theirs is None or not ours[1].any() or not theirs[1].any():
        return float("nan")
    tau = np.union1d(ours[0], theirs[0])
    a, b = (run.mass_scale * np.interp(tau, *found) for run, found in ((mpm, ours), (dem, theirs)))
    under = integral(b, tau)
    return integral(abs(a - b), tau) / under if under > 0.0 else float("nan")


def example():
    # Triangles of height 3 and 2, of one cell; one that is not dense does not count, nor one where
    # the grains' is undefined.
    phi, nan, time = [[[0.5, 0.1, 0.5]]] * 3, float("nan"), (0.0, 1.0, 2.0)
    mpm = [[[t, 9.0, 0.0]] for t in (0.0, 3.0, 0.0)]
    dem = [[[t, 4.0, nan]] for t in (0.0, 2.0, 0.0)]
    return (
        (
            example_run(
                time=time,
                solid_fraction=phi,
                granular_temperature=[[[7.0, 7.0, 7.0]]] * 3,
                granular_temperature_state=mpm,
            ),
            example_run(time=time, solid_fraction=phi, granular_temperature=dem),
        ),
        0.5,
        1e-12,
    )
