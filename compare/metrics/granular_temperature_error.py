from compare.metrics import metric
from compare.mapping.reductions import example_run, masked_error, temperature


@metric(unit="-", source="mass-weighted relative L2 norm in a mask", of_pair=True)
def granular_temperature_error(mpm, dem):
    """Root of sum rho (T_mpm - T_dem)^2 over sum rho T_dem^2, T_mpm the state variable of the
    material points, T_dem measured on the grains (about an affine fit, corrected for
    self-inclusion), over all common instants and the cells where both have more than half of the
    bulk's solid fraction. One for a law that knows no granular temperature.
    """
    return masked_error(mpm, dem, temperature)


def example():
    # 3 against 2 in one cell; a cell where the grains' is undefined and one that only one side
    # fills do not count.
    phi, nan = [[[0.5, 0.5, 0.1]]], float("nan")
    return (
        (
            example_run(
                solid_fraction=phi,
                granular_temperature=[[[7.0, 7.0, 7.0]]],
                granular_temperature_state=[[[3.0, 5.0, 5.0]]],
            ),
            example_run(solid_fraction=phi, granular_temperature=[[[2.0, nan, 4.0]]]),
        ),
        0.5,
        1e-12,
    )
