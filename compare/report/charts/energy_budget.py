import numpy as np
from matplotlib import colormaps

from compare.verdict.budget import budget
from cases.style import INK, LABEL
from compare.report.charts import chart, panels

PALETTES = {"held": "Blues", "dissipated": "Oranges", "numerical": "Greys"}


def colours(accounts) -> list:
    """One hue for what is held, one for what is dissipated, one for numerical losses."""
    by_kind = {kind: [a for a in accounts if a.kind == kind] for kind in PALETTES}
    shade = {
        kind: np.linspace(0.75, 0.25, max(len(members), 1)) for kind, members in by_kind.items()
    }
    return [colormaps[PALETTES[a.kind]](shade[a.kind][by_kind[a.kind].index(a)]) for a in accounts]


def stack(ax, run, accounts, columns: int) -> tuple[float, float]:
    """Stacks the accounts, those above zero upwards and those below it downwards; returns how low
    and how high they reach.
    """
    positive = [np.maximum(a.values, 0.0) for a in accounts]
    negative = [np.minimum(a.values, 0.0) for a in accounts]
    tau = run.energy_tau()
    shades = colours(accounts)
    released = 100 * run.released() / run.reference_energy
    ax.stackplot(
        tau,
        positive,
        colors=shades,
        linewidth=0.0,
        labels=[f"{a.name} {round(100 * a.values[-1], 1) + 0.0:.1f} %" for a in accounts],
    )
    ax.stackplot(tau, negative, colors=shades, linewidth=0.0)
    ax.set(xlabel="t/√(H/g)", ylabel="energy$/E_0$", xlim=(tau[0], tau[-1]))
    ax.axhline(0.0, color=INK, linewidth=0.6)
    handles, labels = ax.get_legend_handles_labels()
    ax.legend(
        handles[::-1],
        labels[::-1],
        loc="upper center",
        bbox_to_anchor=(0.5, -0.2),
        ncols=columns,
        title=f"share of $E_0$ at the end; released {released:.1f} %",
        fontsize=8,
    )
    return np.sum(negative, axis=0).min(), np.sum(positive, axis=0).max()


@chart("Energy budget", order=7)
def energy_budget(comparison, narrow):
    if not comparison.dem[0].reference_energy > 0.0:
        return None  # nobody knows the energy that the grains release
    figure, axes = panels(2, narrow, height=4.4 if narrow else 3.9)
    reach = []
    for ax, run in zip(axes, comparison.first):
        reach.append(stack(ax, run, budget(run), columns=2))
        ax.set(title=LABEL[run.engine])
    bottom, top = min(low for low, _ in reach), max(high for _, high in reach)
    for ax in axes:
        ax.set_ylim(1.03 * min(bottom, 0.0), 1.03 * top)
    lost = comparison.mpm[0].normalised("unaccounted")[-1]
    told = (
        f"The numerics of the continuum lost {100 * lost:.1f} % of E0, the energy that the grains "
        "release: no share of its dissipation is known to better than that. "
        if np.isfinite(lost)
        else "What the continuum dissipated and what its numerics lost was not told. "
    )
    return figure, (
        f"{told}"
        "What the released energy has become: held (blue), dissipated (orange), lost numerically "
        "or unexplained (grey). Totals and times compare; the accounts of dissipation are named by "
        "each engine in its own terms and do not correspond one to one."
    )
