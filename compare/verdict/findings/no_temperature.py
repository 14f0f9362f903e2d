"""Laws without granular temperature."""

from compare.mapping.reductions import has_temperature
from compare.verdict.findings import Finding, Severity, check


@check(order=100)
def no_temperature(c, metrics):
    """Whether the continuum's law has a granular temperature at all: where it has none, figures and
    metrics of it compare the grains with nothing.
    """
    if not has_temperature(c.mpm[0]):
        law = c.mpm[0].case.values.get("material", {}).get("law", "of this run")
        yield Finding(
            Severity.NOTE,
            f"The law {law} has no granular temperature; that of the grains stands alone.",
            "Choose material.law=solid_fluid to compare it.",
            of="mpm",
        )
