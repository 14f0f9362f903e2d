import numpy as np

from compare.report.charts import chart, panels, ticks
from compare.report.charts.collapse.regimes import COLOURS, WORDS
from compare.mapping.reductions import first_entries


@chart("Regimes over time", order=9)
def regime_shares(run, narrow):
    figure, axes = panels(2, narrow, height=3.5)
    tau = run.tau()
    share = np.array(
        [
            [
                cloud.mass[cloud.state["regime"] == k].sum() / cloud.mass.sum()
                for cloud in run.clouds
            ]
            for k in range(5)
        ]
    )
    axes[0].stackplot(
        tau,
        share,
        colors=COLOURS,
        labels=[word.replace("-\n", "-") for word in WORDS],
        linewidth=0.0,
    )
    axes[0].set(
        title="share of the mass in each regime",
        xlabel="t/√(H/g)",
        xlim=(0.0, tau[-1]),
        ylim=(0.0, 1.0),
    )
    axes[0].legend(
        loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=2 if narrow else 3, fontsize=8
    )
    draw_entries(axes[1], run)
    return figure, (
        "Left, how much of the mass is in each regime. Right, when points of a depth first enter "
        "regimes 2, 3 and 4, the median of each tenth of the height; a tenth of which less than "
        "half ever enters a regime has no median and no mark."
    )


def draw_entries(ax, run):
    """When points first enter regimes 2, 3 and 4, over the depth they start from."""
    start = run.clouds[0]
    depth = np.minimum(run.height - start.x[:, 1], run.length - start.x[:, 0]) / run.height
    bands = np.linspace(0.0, 1.0, 11)
    entry = first_entries(run)
    for k in (1, 2, 3):
        middle, times = [], []
        for low, high in zip(bands, bands[1:]):
            inside = (depth >= low) & (depth < high)
            # where half never enter the median is infinite
            if inside.sum() >= 5 and np.isfinite(entry[k][inside]).mean() > 0.5:
                middle.append(0.5 * (low + high))
                times.append(np.median(entry[k][inside]))
        ax.plot(
            middle,
            times,
            "o-",
            ms=3.5,
            color=COLOURS[k + 1],
            label=WORDS[k + 1].replace("-\n", "-"),
        )
    ax.set(
        title="median time of first entry [√(H/g)]",
        xlabel="depth below top or free side at release, over H",
        xlim=(0.0, None),
    )
    ax.set_yscale("log")
    ticks(ax.yaxis, *ax.get_ylim())
    ax.legend(fontsize=8)
