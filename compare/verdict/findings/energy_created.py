"""Energy out of nothing."""

import numpy as np

from compare.mapping.runs import Run
from compare.verdict.budget import ACCOUNTS
from compare.verdict.findings import SIDE, Finding, Severity, check, sides, worst

CREATED = 0.01


def created(run: Run) -> float:
    """What the numerical and dissipative accounts of a run fell below zero by, at the worst of its
    rows, over E0.
    """
    names = [column for _, _, column in ACCOUNTS[run.engine]] + ["unaccounted"]
    falls = [-np.nanmin(run.normalised(name), initial=0.0) for name in names if name in run.energy]
    return float(max(falls, default=0.0))


@check(order=50)
def energy_created(c, metrics):
    """Accounts of dissipation and loss that are negative at any time: only energy that came out of
    nothing makes them so. The grains' residual is sampled, so it is allowed compare.margin_loss.
    """
    for engine, runs in sides(c):
        share, which = worst(runs, created)
        bound = CREATED if engine == "mpm" else c.mpm[0].case["compare.margin_loss"]
        if share > bound:
            yield Finding(
                Severity.INVALID,
                f"The {SIDE[engine]} made {100 * share:.1f} % of the energy released out of "
                f"nothing{which}.",
                "Lower mpm.time_step_fraction."
                if engine == "mpm"
                else "Lower dem.time_step_fraction or dem.audit_interval.",
                share,
                bound,
                unit="E0",
                reason="no exchange makes energy; a hundredth leaves round-off and rest"
                if engine == "mpm"
                else "compare.margin_loss: the grains' balance is sampled, and open by as much",
                of=engine,
            )
