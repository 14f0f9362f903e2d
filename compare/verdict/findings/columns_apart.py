"""Columns that are not packed alike."""

import math

from compare.metrics import all_metrics
from compare.verdict.findings import Finding, Severity, check

APART = 0.02
DENSER = 0.05


@check(order=70)
def columns_apart(c, metrics):
    """Mass of the two columns before the pairing, and their void ratios in the bulk as mapped: a
    denser column dilates more and runs less far, whatever the law.
    """
    scale = metrics["mass_scale"]["value"]
    if abs(scale - 1.0) > APART:
        yield Finding(
            Severity.CAUTION,
            f"The column of the continuum weighs {100 * (1.0 / scale - 1.0):+.1f} % against that "
            "of the grains; the pairing scales its mass, not its void ratio.",
            "Set initial.state=packing, so that the continuum starts from the settled grains, or "
            "a smaller dem.void_ratio_tolerance.",
            abs(scale - 1.0),
            APART,
            reason="two per cent of the mass is 0.035 in the void ratio, a seed's scatter",
        )
    void_ratio = all_metrics()["bulk_void_ratio"]
    e = [metrics["bulk_void_ratio"][engine] for engine in ("mpm", "dem")]
    if None not in e and abs(e[0] - e[1]) > DENSER and math.isfinite(e[0] - e[1]):
        yield Finding(
            Severity.CAUTION,
            f"In the bulk the continuum has the void ratio {e[0]:.3f}, the grains {e[1]:.3f}.",
            "Compare initial.void_ratio with what the packing reached, or set "
            "initial.state=packing.",
            abs(e[0] - e[1]),
            DENSER,
            reason=f"a third of what tells dense from loose ({void_ratio.source})",
        )
