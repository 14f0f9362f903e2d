"""Grains of another program: what was assumed of them, and where they are not those of the case."""

from compare.verdict.findings import Finding, Severity, check

DISAGREES = "disagrees: "
SEEN = ("implausible: ", "absent: all")  # what other checks see


@check(order=15)
def imported(c, metrics):
    """What was assumed, merged or dropped when the grains of another program were imported (a
    note), and what of them disagrees with the case by more than 1 % (caution): the file is right,
    and the continuum is of the case.
    """
    for run in c.dem:
        if not run.imported:
            continue
        name = f"{run.name}.h5" if len(c.dem) > 1 else "The grains"
        other = [one.removeprefix(DISAGREES) for one in run.notes if one.startswith(DISAGREES)]
        if other:
            yield Finding(
                Severity.CAUTION,
                f"{name} disagree with the case: {'; '.join(other)}.",
                "What the files tell was taken; give the case of these grains, or accept it.",
                of="dem",
            )
        rest = [one for one in run.notes if not one.startswith((DISAGREES, *SEEN))]
        if rest:
            made_by = run.attributes.get("engine_version", "unknown")
            yield Finding(
                Severity.NOTE,
                f"{name} were imported ({made_by}). {'; '.join(rest)}.",
                "grainpair compare --help has the option that says otherwise.",
                of="dem",
            )
