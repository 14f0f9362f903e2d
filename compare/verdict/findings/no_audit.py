"""Energies that nobody balanced."""

import numpy as np

from compare.mapping.runs import Run
from compare.verdict.findings import SIDE, Finding, Severity, check, sides


def audited(run: Run) -> bool:
    """Whether the file tells what is not accounted for at the end."""
    return "unaccounted" in run.energy and bool(np.isfinite(run.energy["unaccounted"][-1]))


@check(order=110)
def no_audit(c, metrics):
    """Runs whose energies were not audited: their balance is open, and how their dissipation splits
    is not known.
    """
    for engine, runs in sides(c):
        if engine == "mpm" and any(run.imported for run in runs):
            yield Finding(
                Severity.CAUTION,
                f"The files of the {SIDE[engine]} do not tell what was dissipated or lost.",
                "Take these figures from the program that made them.",
                of=engine,
            )
        elif not all(audited(run) for run in runs):
            yield Finding(
                Severity.CAUTION,
                f"The energies of the {SIDE[engine]} were not audited: their loss and the split of "
                "their dissipation are unknown.",
                "Set dem.audit_interval above 0." if engine == "dem" else "Run the case again.",
                of=engine,
            )
