"""Grains that are too soft."""

from compare.mapping.contacts import largest_overlap
from compare.mapping.runs import Run
from compare.verdict.findings import Finding, Severity, check, worst

OVERLAP = 0.02


def overlap_of(run: Run) -> float:
    """Of the contacts, and of imported grains that of their places at the first and last frame."""
    return max(largest_overlap(run), float(run.attributes.get("largest_overlap", 0.0)))


@check(order=90)
def overlaps(c, metrics):
    """Largest overlap of two grains over the frames, in diameters: softened grains that sink into
    one another are no longer hard ones, and pack denser than they would.
    """
    overlap, which = worst(c.dem, overlap_of)
    if overlap > OVERLAP:
        yield Finding(
            Severity.CAUTION,
            f"Two grains overlap by {100 * overlap:.1f} % of a diameter{which}.",
            "See whether radii and units are right, or the grains too soft."
            if any(run.imported for run in c.dem)
            else "Raise dem.young_modulus.",
            overlap,
            OVERLAP,
            unit="d",
            reason="the stiffness may be lowered while overlaps stay within one to two per cent",
            of="dem",
        )
