"""Runs that ended before their matter did."""

from compare.mapping.runs import Run
from compare.verdict.findings import SIDE, Finding, Severity, check, sides, worst


def moving(run: Run) -> float:
    """Kinetic energy at the end over its peak; zero for a run that came to rest, or has one row."""
    kinetic = run.joules("kinetic")
    at_rest = run.attributes.get("end_reason", "rest") == "rest"
    return 0.0 if at_rest or len(kinetic) < 2 else float(kinetic[-1] / max(kinetic.max(), 1e-300))


@check(order=60)
def still_moving(c, metrics):
    """Runs that ended at time.maximum and not at rest: their final figures are those of an instant
    on the way.
    """
    for engine, runs in sides(c):
        share, which = worst(runs, moving)
        if share > 0.0:
            yield Finding(
                Severity.CAUTION,
                f"The {SIDE[engine]} did not come to rest: at the end the kinetic energy is "
                f"{100 * share:.2g} % of its peak{which}.",
                "Raise time.maximum.",
                share,
                runs[0].case["time.rest_kinetic_energy"],
                unit="of its peak",
                reason="time.rest_kinetic_energy: what counts as rest",
                of=engine,
            )
