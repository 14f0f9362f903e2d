"""Work against precision: every recipe as a point, the Pareto front, the seeds' scatter as a band,
failures on the top edge.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from cases.style import DEM, INK
from compare.report.charts import panels
from compare.study.charts import STUDY_STYLE, save
from compare.study.frontier import band, front, grain_cost
from compare.study.distance import WORDS

LAWS = {
    "drucker_prager": "#7a9a01",
    "mu_i": "#00857c",
    "lade_duncan": "#1f5fa8",
    "critical_state": "#7b4ea3",
    "solid_fluid": "#b0367a",
    "contact_share": "#d2691e",
    "linear_elastic": "#8a8f98",
}
MARKERS = ("o", "s", "^", "v", "D", "P", "X", "<", ">", "p", "h", "*", "d", "8")


def draw(points: pd.DataFrame, reference: dict, name: str, path: Path) -> str:
    """The chart against the grains' mean; returns its SVG."""
    with plt.rc_context(STUDY_STYLE):
        figure, (axes,) = panels(1, False, height=5.2)
        top = scatter(axes, points[~points["fine"]], f"error_{name}", path.stem)
        level = band(reference, name)
        typical = np.mean(reference["scatter"][name])
        lowest = 0.7 * min(points.loc[~points["fine"], f"error_{name}"].min(), typical)
        whiskers(axes, points[~points["fine"]], name, lowest)
        axes.axhspan(lowest, level, color=DEM, alpha=0.10, lw=0)
        axes.plot(grain_cost(reference), typical, "*", color=DEM, ms=14, mec="white", zorder=5)
        axes.annotate(
            "the grains as\nthe case has them",
            (grain_cost(reference), typical),
            textcoords="offset points",
            xytext=(0, 9),
            color=DEM,
            ha="center",
            fontsize=8.5,
        )
        axes.set_ylim(bottom=lowest)
        axes.text(
            0.005,
            level,
            " scatter of the grains' seeds",
            transform=axes.get_yaxis_transform(),
            color=DEM,
            va="top",
            fontsize=8.5,
        )
        finish(axes, top, f"error from the grains' mean:\n{WORDS[name]}")
        return save(figure, path, tips(points, path.stem, f"error_{name}"))


def draw_numerical(points: pd.DataFrame, name: str, path: Path) -> str:
    """The chart against each law's own fine-grid solution; the error of that solution from the
    grains is a line.
    """
    with plt.rc_context(STUDY_STYLE):
        figure, (axes,) = panels(1, False, height=5.2)
        own = points[
            ~points["fine"] & ~((points["status"] == "ok") & points[f"numerical_{name}"].isna())
        ]
        top = scatter(axes, own[own["engine"] == "mpm"], f"numerical_{name}", path.stem)
        for i, (_, limit) in enumerate(
            points[points["fine"] & (points["status"] == "ok")].iterrows()
        ):
            axes.axhline(limit[f"error_{name}"], color=LAWS[limit["law"]], ls=(0, (4, 2)), lw=1.2)
            axes.text(
                0.998 - 0.33 * (i % 3),
                limit[f"error_{name}"],
                f"model error of {limit['law'].replace('_', ' ')} "
                f"({1e3 * float(limit['cell_size']):.3g} mm) ",
                transform=axes.get_yaxis_transform(),
                color=LAWS[limit["law"]],
                va="bottom",
                ha="right",
                fontsize=8,
            )
        finish(axes, top, f"error from the law's fine-grid solution:\n{WORDS[name]}")
        return save(figure, path, tips(points, path.stem, f"numerical_{name}"))


def scatter(axes, points: pd.DataFrame, column: str, prefix: str) -> float:
    """Every point by law and series, the front as a line; returns the height of failures."""
    good, bad = points[points["status"] == "ok"], points[points["status"] != "ok"]
    top = 2.0 * max(good[column].max(), 0.5)
    names = {name: marker for name, marker in zip(points["series"].unique(), MARKERS * 2)}
    best = front(good["cost"].to_numpy(), good[column].to_numpy())
    axes.step(
        good["cost"].iloc[best],
        good[column].iloc[best],
        where="post",
        color=INK,
        lw=1.0,
        alpha=0.6,
        zorder=1,
    )
    on_front = set(good["key"].iloc[best])
    for rows, height in ((good, None), (bad, top)):
        for _, row in rows.iterrows():
            colour = DEM if row["engine"] == "dem" else LAWS[row["law"]]
            axes.plot(
                row["cost"] if height is None else row["cpu_seconds"],
                row[column] if height is None else height,
                marker=names[row["series"]] if height is None else "x",
                color=colour,
                ms=7 if row["key"] in on_front else 5.5,
                mec=INK if row["key"] in on_front else ("white" if height is None else colour),
                mew=1.2 if height else 0.8,
                ls="none",
                alpha=1.0 if row["key"] in on_front or height else 0.75,
                gid=f"{prefix}-{row['key']}",
                zorder=3,
            )
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="processor seconds per √(H/g) of physical time (failed runs: until they failed)",
    )
    axes.set_ylim(top=1.4 * top)
    handles = [
        plt.Line2D([], [], ls="none", marker=marker, color="#5d636d", label=name)
        for name, marker in names.items()
    ]
    handles += [
        plt.Line2D([], [], ls="none", marker="o", color=LAWS[law], label=law.replace("_", " "))
        for law in LAWS
        if law in set(points["law"])
    ]
    handles += [plt.Line2D([], [], ls="none", marker="o", color=DEM, label="grains (DEM)")] * int(
        (points["engine"] == "dem").any()
    )
    handles += [
        plt.Line2D([], [], ls="none", marker="x", color="#5d636d", label="failed (top edge)")
    ] * int(not bad.empty)
    axes.legend(handles=handles, fontsize=7.5, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return top


def whiskers(axes, points: pd.DataFrame, name: str, lowest: float):
    """What of each error from the grains the numerics may be, as a vertical line."""
    if f"bar_{name}" not in points:
        return
    known = points[points[f"bar_{name}"].notna()]
    error, width = known[f"error_{name}"], known[f"bar_{name}"]
    axes.vlines(
        known["cost"],
        np.maximum(error - width, lowest),
        error + width,
        colors=known["law"].map(LAWS),
        lw=0.8,
        alpha=0.45,
        zorder=2,
    )


def finish(axes, top: float, label: str):
    axes.set_ylabel(label)
    axes.axhline(top, color="#b3261e", lw=0.6, alpha=0.5)
    axes.yaxis.set_major_formatter(lambda value, _: f"{100 * value:.3g} %")


def tips(points: pd.DataFrame, prefix: str, column: str) -> dict[str, str]:
    return {
        f"{prefix}-{row['key']}": f"{row['engine'].upper()}, {row['series']}: {row['label']}\n"
        + (
            f"{row['cost']:.3g} s per √(H/g), {row[column]:.2%} off"
            if row["status"] == "ok"
            else f"{row['status']}: {row['message']}"
        )
        + f"\n{row['command']}"
        for _, row in points.iterrows()
    }
