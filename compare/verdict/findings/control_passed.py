"""Controls that were let through."""

from compare.verdict.findings import Finding, Severity, check


@check(order=120)
def control_passed(c, metrics):
    """Negative controls that are not told from the grains: then agreement of the continuum would
    mean as little.
    """
    for name, one in metrics.items():
        if name.startswith("control_") and one["value"] != "rejected":
            yield Finding(
                Severity.CAUTION,
                f"The control {name.removeprefix('control_').replace('_', ' ')} is not rejected: "
                "margins or scatter are too wide for the verdict to mean much.",
                "Narrow the compare.margin_… keys, or run more packings (--seeds).",
            )
