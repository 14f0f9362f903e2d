import numpy as np

from compare.metrics import metric
from compare.mapping.reductions import common_frames, dense_in_both, example_run, stress


@metric(unit="-", source="mass-weighted mean in a mask", of_pair=True)
def pressure_bias(mpm, dem):
    """Sum rho (p_mpm - p_dem) over sum rho p_dem, p = trace(sigma)/3, stresses, instants and cells
    as for stress_error: positive where the continuum is under the greater pressure on average,
    which no norm tells.
    """
    difference = reference = 0.0
    for i, k in common_frames(mpm, dem):
        mask = dense_in_both(mpm, dem, i, k)
        a, b = (
            np.trace(stress(run, frame)[mask], axis1=-2, axis2=-1) / 3
            for run, frame in ((mpm, i), (dem, k))
        )
        rho, known = dem.fields["density"][k][mask], np.isfinite(a + b)
        difference += float(np.sum((rho * (a - b))[known]))
        reference += float(np.sum((rho * b)[known]))
    return difference / reference if reference > 0.0 else float("nan")


def example():
    # +2 in one cell and -1 in another, of 4 each: the signs stay, the mean is +0.5 of 4.
    phi, one = [[[0.5, 0.5]]], np.eye(3)
    return (
        (
            example_run(solid_fraction=phi, stress_state=[[[6.0 * one, 3.0 * one]]]),
            example_run(
                solid_fraction=phi,
                contact_stress=[[[4.0 * one, 4.0 * one]]],
                kinetic_stress=[[[0.0 * one, 0.0 * one]]],
            ),
        ),
        0.125,
        1e-12,
    )
