import numpy as np

from compare.metrics import metric
from compare.mapping.reductions import example_run, masked_error, stress


@metric(unit="-", source="mass-weighted relative L2 norm in a mask", of_pair=True)
def stress_error(mpm, dem):
    """Root of sum rho |sigma_mpm - sigma_dem|^2 over sum rho |sigma_dem|^2, all components: the
    material points' own stress against contact plus kinetic stress of the grains, over all common
    instants and the cells where both have more than half of the bulk's solid fraction.
    """
    return masked_error(mpm, dem, stress)


def example():
    # sigma = 4 I against 3 I + 2 I: a fifth of it is missing.
    phi, one = [[[0.5]]], np.eye(3)[None, None, None]
    return (
        (
            example_run(solid_fraction=phi, stress_state=4.0 * one),
            example_run(solid_fraction=phi, contact_stress=3.0 * one, kinetic_stress=2.0 * one),
        ),
        0.2,
        1e-12,
    )
