"""A continuum whose numerical error nobody knows."""

from compare.verdict.findings import Finding, Severity, check


@check(order=120)
def no_error_bar(c, metrics):
    """A continuum without the two siblings that tell its numerical error
    (compare/verdict/siblings.py).
    """
    if c.numerical_uncertainty or not c.mpm:
        return
    why = f" ({c.no_siblings})" if c.no_siblings else ""
    yield Finding(
        Severity.CAUTION if c.no_siblings else Severity.NOTE,
        f"What the continuum's figures may be off by for its numerics is unknown{why}.",
        "grainpair compare RUN --siblings makes what is missing.",
        of="mpm",
    )
