"""What changes of the numerics change: final extent with intervals against their limits, and the
shares of energy lost.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from compare.study.charts import STUDY_STYLE, Picture, save

EXTENT = {
    "run_out_95": ("run-out, 95 %", "#1f5fa8"),
    "centre": ("centre of mass", "#7aa6d6"),
    "height": ("height", "#c46a1b"),
}
LOSSES = {
    "loss_transfer": ("transfer", "#5b3d8a"),
    "loss_time_integration": ("time integration", "#c46a1b"),
    "loss_mixing": ("mixing", "#2c7a4b"),
    "loss_detached": ("detachment", "#b3261e"),
}


def draw(table, path: Path) -> Picture:
    names = list(dict.fromkeys(zip(table["group"], table["setting"])))
    rows = {
        name: part.set_index("figure")
        for name, part in table.groupby(["group", "setting"], sort=False)
    }
    with plt.rc_context(STUDY_STYLE):
        figure, (left, right) = plt.subplots(
            1,
            2,
            figsize=(10.0, 1.2 + 0.36 * len(names)),
            layout="constrained",
            sharey=True,
            width_ratios=(3, 2),
        )
        for i, (group, setting) in enumerate(names):
            part, base = rows[group, setting], rows[group, next(s for g, s in names if g == group)]
            draw_extent(left, i, part, base)
            start = 0.0
            for name, (_, colour) in LOSSES.items():
                if name in part.index:
                    share = max(part["mean"][name], 0.0)
                    right.barh(i, share, left=start, height=0.6, color=colour, lw=0)
                    start += share
        left.axvline(0.0, color="0.6", lw=0.8)
        left.set_yticks(
            range(len(names)),
            [
                setting if setting != names[0][1] else f"{group}: {setting}"
                for group, setting in names
            ],
        )
        left.set_ylim(len(names) - 0.5, -0.5)
        left.set_xlabel("change from the group's first; shaded: limit")
        right.set_xlabel("energy lost by numerics, of that released")
        for ax in (left, right):
            ax.xaxis.set_major_formatter(lambda value, _: f"{100 * value:.3g} %")
        for ax, words in ((left, EXTENT), (right, LOSSES)):
            handles = [
                plt.Line2D(
                    [], [], marker="o" if ax is left else "s", ls="", color=colour, label=word
                )
                for word, colour in words.values()
            ]
            ax.legend(
                handles=handles,
                loc="lower center",
                bbox_to_anchor=(0.5, 1.0),
                ncols=3 if ax is left else 2,
                frameon=False,
                fontsize=9,
            )
        return save(figure, path, {}, table, told(table))


def told(table) -> str:
    """Of each measure with a limit the least and the greatest change, and what lies beyond."""
    judged = table[table["figure"].isin(list(EXTENT)) & table["change"].notna()]
    judged = judged[judged["change"] != 0.0]
    said = [
        f"{EXTENT[name][0]} {', '.join(map(change, ends(rows)))}"
        for name, rows in judged.groupby("figure", sort=False)
    ]
    if not said:
        return "No change is judged."
    beyond = judged[judged["verdict"].isin(("differ", "outside margin"))]
    words = [f"{change(row)}, {EXTENT[row['figure']][0]}" for _, row in beyond.iterrows()]
    return (
        f"{len(judged)} changes from each group's first; the least and the greatest: "
        f"{'; '.join(said)}. "
        + (f"Beyond their limit: {'; '.join(words)}." if words else "None lies beyond its limit.")
    )


def ends(rows) -> list:
    """The row of the least change and that of the greatest."""
    return [rows.loc[rows["change"].idxmin()], rows.loc[rows["change"].idxmax()]]


def change(row) -> str:
    return f"{row['change']:+.1%} ({row['setting']})"


def draw_extent(ax, place: int, part, base):
    """How far the extent of one setting lies from that of its group's first, beside the limits."""
    for k, (name, (_, colour)) in enumerate(EXTENT.items()):
        y = place + 0.22 * (k - 1)
        limit = part["limit"].get(name)
        if limit == limit and part["verdict"][name] == part["verdict"][name]:
            ax.barh(y, 2 * limit, left=-limit, height=0.2, color=colour, alpha=0.15, lw=0)
        scale = base["mean"][name]
        spread = part["deviation"][name] / scale
        ax.errorbar(
            part["mean"][name] / scale - 1.0,
            y,
            xerr=None if np.isnan(spread) else spread,
            fmt="o",
            ms=4,
            color=colour,
            lw=1.2,
        )
