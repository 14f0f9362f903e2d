"""Work against precision: every recipe as a point, the Pareto front, the seeds' scatter as a band,
failures on the top edge.
"""

import textwrap
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.ticker import LogLocator, NullFormatter

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
        shown = told(points, f"error_{name}")
        top = scatter(axes, shown, f"error_{name}", path.stem)
        level = band(reference, name)
        typical = np.mean(reference["scatter"][name])
        lowest = 0.7 * np.nanmin([shown[f"error_{name}"].min(), typical])
        handles = whiskers(axes, shown, name, lowest)
        axes.axhspan(lowest, level, color=DEM, alpha=0.10, lw=0)
        if np.isfinite(price := grain_cost(reference)):
            axes.plot(price, typical, "*", color=DEM, ms=14, mec="white", zorder=5)
            axes.annotate(
                "the grains as\nthe case has them",
                (price, typical),
                textcoords="offset points",
                xytext=(-10, 0),
                color=DEM,
                ha="right",
                va="center",
                fontsize=8.5,
            )
        axes.set_ylim(bottom=lowest)
        axes.text(
            0.995,
            level,
            "scatter of the grains' seeds ",
            transform=axes.get_yaxis_transform(),
            color=DEM,
            va="bottom",
            ha="right",
            fontsize=8.5,
        )
        legend(axes, shown, handles)
        finish(axes, top, "error from the grains' mean:", name)
        return save(figure, path, tips(points, path.stem, f"error_{name}"))


def draw_numerical(points: pd.DataFrame, name: str, path: Path) -> str:
    """The chart against each law's own fine-grid solution; the error of that solution from the
    grains is a line.
    """
    with plt.rc_context(STUDY_STYLE):
        figure, (axes,) = panels(1, False, height=5.2)
        own = told(points, f"numerical_{name}")
        top = scatter(axes, own[own["engine"] == "mpm"], f"numerical_{name}", path.stem)
        for i, (_, limit) in enumerate(
            points[points["fine"] & (points["status"] == "ok")].iterrows()
        ):
            axes.axhline(limit[f"error_{name}"], color=LAWS[limit["law"]], ls=(0, (4, 2)), lw=1.2)
            axes.text(
                0.998 - 0.33 * (i % 3),
                limit[f"error_{name}"],
                f"model error of {limit['law'].replace('_', ' ')}, {limit['card']} "
                f"({1e3 * float(limit['cell_size']):.3g} mm) ",
                transform=axes.get_yaxis_transform(),
                color=LAWS[limit["law"]],
                va="bottom",
                ha="right",
                fontsize=8,
            )
        legend(axes, own[own["engine"] == "mpm"])
        finish(axes, top, "error from the law's fine-grid solution:", name)
        return save(figure, path, tips(points, path.stem, f"numerical_{name}"))


def told(points: pd.DataFrame, column: str) -> pd.DataFrame:
    """Points of recipes that a chart of `column` shows: failed ones, and those with a value."""
    return points[~points["fine"] & ((points["status"] != "ok") | points[column].notna())]


def scatter(axes, points: pd.DataFrame, column: str, prefix: str) -> float:
    """Every point by law and series, the front as a line; returns the height of failures."""
    good, bad = points[points["status"] == "ok"], points[points["status"] != "ok"]
    top = 2.0 * max([0.5, *good[column]])
    names = markers(points)
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
        xlabel="the engine's processor seconds per √(H/g) (failed runs: all until they failed)",
    )
    axes.set_ylim(top=1.4 * top)
    return top


def markers(points: pd.DataFrame) -> dict[str, str]:
    """The marker of each series."""
    return dict(zip(points["series"].unique(), MARKERS * 2))


def legend(axes, points: pd.DataFrame, more: Sequence = ()):
    """Series by marker, laws by colour, and `more` handles."""
    handles = [
        plt.Line2D([], [], ls="none", marker=marker, color="#5d636d", label=name)
        for name, marker in markers(points).items()
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
    ] * int((points["status"] != "ok").any())
    axes.legend(
        handles=[*handles, *more], fontsize=7.5, loc="center left", bbox_to_anchor=(1.0, 0.5)
    )


def whiskers(axes, points: pd.DataFrame, name: str, lowest: float) -> list:
    """What of each error from the grains the numerics may be, as a vertical line: strong for points
    on the front, faint for the others, whose lines would hide each other. A line that would pass
    the lower edge ends there. Returns the legend's handle, if there are any.
    """
    known = points[points["status"] == "ok"]
    best = front(known["cost"].to_numpy(), known[f"error_{name}"].to_numpy())
    strong = set(known["key"].iloc[best])
    known = known[known[f"bar_{name}"].notna()] if f"bar_{name}" in known else known[:0]
    for _, row in known.iterrows():
        error, width, ahead = row[f"error_{name}"], row[f"bar_{name}"], row["key"] in strong
        axes.vlines(
            row["cost"],
            max(error - width, lowest),
            error + width,
            colors=LAWS[row["law"]],
            lw=1.6 if ahead else 0.7,
            alpha=0.8 if ahead else 0.25,
            zorder=2,
        )
    line = plt.Line2D([], [], marker="|", ls="none", ms=12, color="#5d636d")
    line.set_label("numerical error bar")
    return [line] if len(known) else []


def finish(axes, top: float, what: str, name: str):
    axes.set_ylabel("\n".join([what, *textwrap.wrap(WORDS[name], 48)]))
    axes.axhline(top, color="#b3261e", lw=0.6, alpha=0.5)
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(lambda value, _: f"{100 * value:.3g} %")
    axes.yaxis.set_minor_formatter(NullFormatter())


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
