"""Points of the continuum that fly."""

from compare.metrics.moving_without_stress import moving_without_stress
from compare.verdict.findings import Finding, Severity, check, worst

SHARE = 0.1


@check(order=80)
def without_stress(c, metrics):
    """Moving points that carry no stress: no law is at work there, they fall as free points do."""
    share, which = worst(c.mpm, moving_without_stress)
    if share > SHARE:
        yield Finding(
            Severity.NOTE,
            f"{100 * share:.0f} % of what moves in the continuum carries no stress{which}: there "
            "the law says nothing.",
            "See where stress vanishes (grainpair export) before the law is praised or blamed.",
            share,
            SHARE,
            unit="of the moving mass",
            reason="a tenth of the flow is no longer its rim",
            of="mpm",
        )
