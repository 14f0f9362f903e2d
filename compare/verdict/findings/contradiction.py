"""Figures of one deposit that contradict one another."""

from dataclasses import replace

from compare.metrics import all_metrics
from compare.verdict.comparison import margin_of
from compare.verdict.findings import Finding, Severity, check

# How far the deposit reaches, in several ways; those without a margin of their own are held
# against that of the run-out.
REACH = {
    "run_out_95": "run-out by 95 % of the mass",
    "run_out_99": "run-out by 99 %",
    "run_out": "run-out by 99.5 %",
    "run_out_height": "free surface",
    "centre_of_mass_x": "centre of mass",
}


@check(order=130)
def contradiction(c, metrics):
    """Signs of the differences in how far the deposit reaches, by quantiles of mass, free surface
    and centre of mass: where one beyond its margin is contradicted by another, the deposits differ
    in shape, and no single figure says which goes further.
    """
    differences, beyond = {}, []
    for name in REACH:
        difference = metrics[name]["difference"]
        if not difference:
            continue
        differences[name] = difference
        metric = all_metrics()[name]
        metric = metric if metric.margin else replace(metric, margin="compare.margin_run_out")
        if abs(difference) > margin_of(metric, c.mpm[0], metrics[name]["dem"]):
            beyond.append(name)
    against = [a for a in beyond if any(differences[a] * d < 0.0 for d in differences.values())]
    if against:
        told = ", ".join(f"{REACH[name]} {d:+.2f} L0" for name, d in differences.items())
        yield Finding(
            Severity.NOTE,
            f"Continuum less grains, the figures contradict one another: {told}.",
            "Read the free surfaces and wasserstein_x: the deposits differ in shape, not in reach "
            "alone.",
            max(abs(differences[name]) for name in against),
            unit="L0",
            reason="each against its margin; compare.margin_run_out where it has none",
        )
