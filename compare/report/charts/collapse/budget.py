import numpy as np

from compare.verdict.budget import budget as accounts_of
from compare.report.charts import chart, panels
from compare.report.charts.energy_budget import stack


@chart("Energy budget", order=7)
def budget(run, narrow):
    figure, (ax,) = panels(1, narrow, height=5.0 if narrow else 4.0)
    accounts = accounts_of(run, split=False)
    bottom, top = stack(ax, run, accounts, columns=2 if narrow else 3)
    ax.set_ylim(1.03 * bottom, 1.03 * top)
    numerical = sum(a.values[-1] for a in accounts if a.kind == "numerical")
    return figure, (
        "What the released energy has become, account on account: held (blue), dissipated "
        "(orange), and the numerical losses as bands of their own (grey), "
        f"{100 * np.round(numerical, 4) + 0.0:.1f} % at the end. Every share is over the potential "
        "energy released until the end; an account below zero is drawn below the axis."
    )
