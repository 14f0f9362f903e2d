"""Energy that went neither into motion nor into any dissipation."""

import numpy as np

from compare.verdict.comparison import numerical_loss
from compare.verdict.findings import SIDE, Finding, Severity, check, sides, worst


@check(order=40)
def energy_lost(c, metrics):
    """Numerical loss: energy unaccounted for at the end over the energy E0 that the grains release,
    against compare.margin_loss.
    """
    for engine, runs in sides(c):
        loss, which = worst(runs, lambda run: float(np.nan_to_num(numerical_loss(run))))
        margin = c.mpm[0].case["compare.margin_loss"]
        if loss > margin:
            yield Finding(
                Severity.INVALID,
                f"{100 * loss:.1f} % of the energy released is lost in the numerics of the "
                f"{SIDE[engine]}{which}.",
                "Use finer cells (mpm.cell_size), a shorter step, or a transfer that loses less; "
                "compare.margin_loss is what you accept."
                if engine == "mpm"
                else "Lower dem.audit_interval; compare.margin_loss is what you accept.",
                loss,
                margin,
                unit="E0",
                reason="compare.margin_loss: a loss of the size of the margin of energies cannot "
                "be told from physics",
                of=engine,
            )
