"""A stiffness so low that the answer feels it."""

from compare.metrics.softening_error import softening_error
from compare.metrics.weight_to_stiffness import weight_to_stiffness
from compare.verdict.findings import SIDE, Finding, Severity, check, sides, worst


@check(order=87)
def softened(c, metrics):
    """What softer grains, or a softer skeleton, are expected to move the headline figures by
    (cases/softening.toml), against the margin of the run-out: told above half of it, a caution
    above all of it.
    """
    for engine, runs in sides(c):
        margin = runs[0].case["compare.margin_run_out"]
        error, _ = worst(runs, softening_error)
        if error > 0.5 * margin:
            weight, _ = worst(runs, weight_to_stiffness)
            key = "mpm.weight_to_stiffness" if engine == "mpm" else "dem.young_modulus"
            yield Finding(
                Severity.CAUTION if error > margin else Severity.NOTE,
                f"Softened to rho g H/K = {weight:.2g}, the {SIDE[engine]} may move the headline "
                f"figures by {100 * error:.2g} %.",
                f"{'Lower' if engine == 'mpm' else 'Raise'} {key}.",
                error,
                margin,
                reason="the margin of the run-out",
                of=engine,
            )
