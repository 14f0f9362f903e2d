from compare.metrics import metric
from compare.mapping.reductions import example_run, masked_error


@metric(unit="-", source="mass-weighted relative L2 norm in a mask", of_pair=True)
def velocity_error(mpm, dem):
    """Root of sum rho |V_mpm - V_dem|^2 over sum rho |V_dem|^2, with the grains' density, over all
    common instants and the cells where both have more than half of the bulk's solid fraction.
    """
    return masked_error(mpm, dem, lambda run, frame: run.fields["velocity"][frame])


def example():
    # The grains move at 2 m/s, the continuum at 3 m/s, in the only cell that both fill.
    phi = [[[0.5, 0.1]]]
    return (
        (
            example_run(solid_fraction=phi, velocity=[[[[3.0, 0.0, 0.0], [9.0, 9.0, 9.0]]]]),
            example_run(solid_fraction=phi, velocity=[[[[2.0, 0.0, 0.0], [0.0, 0.0, 0.0]]]]),
        ),
        0.5,
        1e-12,
    )
