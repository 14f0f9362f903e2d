"""Grains that are too soft."""

from compare.mapping.contacts import largest_overlap
from compare.verdict.findings import Finding, Severity, check, worst

OVERLAP = 0.02


@check(order=90)
def overlaps(c, metrics):
    """Largest overlap of two grains over the frames, in diameters: softened grains that sink into
    one another are no longer hard ones, and pack denser than they would.
    """
    overlap, which = worst(c.dem, largest_overlap)
    if overlap > OVERLAP:
        yield Finding(
            Severity.CAUTION,
            f"Two grains overlap by {100 * overlap:.1f} % of a diameter{which}.",
            "Raise dem.young_modulus.",
            overlap,
            OVERLAP,
            unit="d",
            reason="the stiffness may be lowered while overlaps stay within one to two per cent",
            of="dem",
        )
