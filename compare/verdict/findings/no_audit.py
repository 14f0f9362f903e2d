"""Energies that nobody balanced."""

import math

from compare.verdict.comparison import numerical_loss
from compare.verdict.findings import SIDE, Finding, Severity, check, sides


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
        elif any(math.isnan(numerical_loss(run)) for run in runs):
            yield Finding(
                Severity.CAUTION,
                f"The energies of the {SIDE[engine]} were not audited: their loss and the split of "
                "their dissipation are unknown.",
                "Set dem.audit_interval above 0." if engine == "dem" else "Run the case again.",
                of=engine,
            )
