"""Constants of the law that contradict the grains beside it."""

from compare.verdict.findings import Finding, Severity, check


@check(order=85)
def contradicted_constants(c, metrics):
    """Every line of the continuum's attribute `contradictions`: constants that the grains
    determine, given for other grains than the case's (cases/constants.cpp has the bounds). Then the
    comparison is of two materials.
    """
    lines = {
        line
        for run in c.mpm
        for line in str(run.attributes.get("contradictions", "none")).splitlines()
        if line.strip() not in ("", "none")
    }
    for line in sorted(lines):
        problem, closed, hint = line.strip().rpartition(") ")
        yield Finding(
            Severity.CAUTION,
            f"The law is not of these grains: {problem}{closed.strip()}.",
            f"{hint[:1].upper()}{hint[1:]}.",
            of="mpm",
        )
