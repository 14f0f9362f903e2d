import numpy as np

from compare.metrics import metric
from compare.mapping.reductions import bulk_solid_fraction, example_run


@metric(unit="-", source="mapped solid fraction")
def bulk_void_ratio(run):
    """Void ratio of the column at release: total voids over total solid in the cells with more than
    0.9 of the case's solid fraction, which leaves the surface out.
    """
    phi = run.fields["solid_fraction"][0]
    phi = phi[phi > 0.9 * bulk_solid_fraction(run)]
    return float((1.0 - np.mean(phi)) / np.mean(phi)) if phi.size else float("nan")


def example():
    # Cells of 0.5 and 0.6; the half-filled surface cell is left out.
    return (example_run(solid_fraction=[[[0.5, 0.6, 0.3]]]),), 0.45 / 0.55, 1e-12
