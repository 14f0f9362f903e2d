"""Work against precision: every recipe as a point, the Pareto front, the seeds' scatter as a band,
failures on the top edge.
"""

import textwrap
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, NullFormatter

from cases.errors import CaseError
from cases.style import DEM, INK
from compare.report.charts import panels
from compare.study.charts import STUDY_STYLE, Picture, save
from compare.study.frontier import band, front, grain_cost
from compare.study.distance import WORDS

LAWS = {
    "drucker_prager": "#7a9a01",
    "mu_i": "#00857c",
    "lade_duncan": "#1f5fa8",
    "critical_state": "#7b4ea3",
    "solid_fluid": "#b0367a",
    "contact_share": "#e0a100",
    "external": "#3a3f47",
    "linear_elastic": "#8a8f98",
}
# Shapes that are told apart at five points: no hexagon or octagon beside a circle, no thin diamond.
SHAPES = ("o", "s", "^", "v", "D", "P", "X", "<", ">", "p")
DASHES = ((5, 2), (2, 1.5), (7, 2, 1.5, 2))
FILLS = ("full", "none", "left")
# The legend stands below the plot, both as high as they need to be [in].
COLUMNS, PLOT, ROW = 4, 4.6, 0.19
MARKERS = [(shape, fill) for fill in FILLS for shape in SHAPES]


def draw(points: pd.DataFrame, reference: dict, name: str, path: Path) -> Picture:
    """The chart against the grains' mean."""
    with plt.rc_context(STUDY_STYLE):
        figure, (axes,) = panels(1, False, height=5.2)
        shown = told(points, f"error_{name}")
        level = band(reference, name)
        typical = np.mean(reference["scatter"][name])
        lowest = lower_edge(shown[f"error_{name}"], typical)
        drawn = shown.assign(**{f"error_{name}": shown[f"error_{name}"].clip(lower=lowest)})
        top = scatter(axes, drawn, f"error_{name}", path.stem)
        handles = whiskers(axes, shown, name, lowest)
        axes.axhspan(lowest, level, color=DEM, alpha=0.10, lw=0)
        if np.isfinite(price := grain_cost(reference)):
            star = {"marker": "*", "color": DEM, "mec": INK, "ms": 14, "ls": "none"}
            axes.plot(price, typical, zorder=5, **star)
            handles.append(plt.Line2D([], [], label="the grains as the case has them", **star))
        axes.set_ylim(bottom=lowest)
        handles.append(Patch(color=DEM, alpha=0.15, lw=0, label="scatter of the grains' seeds"))
        legend(axes, shown, handles)
        finish(axes, top, "error from the grains' mean:", name)
        return saved(figure, path, points, shown, f"error_{name}")


def lower_edge(errors: pd.Series, typical: float) -> float:
    """Where the axis of errors begins [-]: below the least, but for errors of none, which no
    logarithm has; they stand on it.
    """
    return 0.7 * float(np.nanmin([errors[errors > 0.0].min(), typical]))


def draw_numerical(points: pd.DataFrame, name: str, path: Path) -> Picture:
    """The chart against each law's own fine-grid solution; the error of that solution from the
    grains is a line.
    """
    with plt.rc_context(STUDY_STYLE):
        figure, (axes,) = panels(1, False, height=5.2)
        own = told(points, f"numerical_{name}")
        top = scatter(axes, own[own["engine"] == "mpm"], f"numerical_{name}", path.stem)
        handles = []
        limits = points[points["fine"] & (points["status"] == "ok")]
        for i, (_, limit) in enumerate(limits.iterrows()):
            style = {"color": LAWS[limit["law"]], "ls": (4 * i, DASHES[i % len(DASHES)]), "lw": 1.4}
            axes.axhline(limit[f"error_{name}"], **style)
            handles.append(plt.Line2D([], [], label=model_error(limit, name), **style))
        legend(axes, own[own["engine"] == "mpm"], handles)
        finish(axes, top, "error from the law's fine-grid solution:", name)
        shown = own[own["engine"] == "mpm"]
        return saved(figure, path, points, shown, f"numerical_{name}")


def model_error(limit: pd.Series, name: str) -> str:
    """What a law's solution on the fine grid is off by from the grains, for the legend."""
    law, size = limit["law"].replace("_", " "), 1e3 * float(limit["cell_size"])
    return f"{law}, {limit['card']}, {size:.3g} mm: {limit[f'error_{name}']:.1%} off by its model"


def saved(figure, path: Path, points, shown: pd.DataFrame, column: str) -> Picture:
    """The chart with what each of the `shown` recipes is off by, and in words its front."""
    good = shown[shown["status"] == "ok"].sort_values("cost")
    ahead = front(good["cost"].to_numpy(), good[column].to_numpy())
    steps = "; ".join(
        f"{row['label']} {row[column]:.1%} off at {row['cost']:.2g} s per √(H/g)"
        for _, row in good.iloc[ahead].sort_values("cost").iterrows()
    )
    alt = (
        f"{len(good)} recipes and {len(shown) - len(good)} that failed. The front, from cheap to "
        f"dear: {steps}."
    )
    told = ["engine", "series", "label", "law", "status", "cost", "cpu_seconds", column]
    bar = column.replace("error_", "bar_")
    told += [bar] if bar != column and bar in shown else []
    return save(figure, path, tips(points, path.stem, column), shown[told], alt)


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
    for _, row in good.iterrows():
        mark(axes, row, row[column], names[row["series"]], row["key"] in on_front, prefix)
    for _, row in bad.iterrows():
        axes.plot(
            row["cpu_seconds"],
            top,
            "x",
            color=colour(row),
            ms=5.5,
            mew=1.2,
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


def colour(row) -> str:
    return DEM if row["engine"] == "dem" else LAWS[row["law"]]


def look(shape: str, fill: str, shade: str) -> dict:
    """A marker of one shape and fill in the colour of a law."""
    return {
        "marker": shape,
        "fillstyle": fill,
        "color": shade,
        "markerfacecoloralt": "white",
        "mec": "white" if fill == "full" else shade,
        "mew": 0.6 if fill == "full" else 1.1,
        "ls": "none",
    }


def mark(axes, row, height: float, marker: tuple[str, str], ahead: bool, prefix: str):
    """A run that ended well; on the front it is larger, with its outline in ink behind it."""
    shape, fill = marker
    style = look(shape, fill, colour(row)) | {"ms": 7.0 if ahead else 5.5}
    if fill == "none":
        style |= {"fillstyle": "full", "mfc": "white"}
    if ahead:
        axes.plot(row["cost"], height, shape, color=INK, ms=10.0, mew=0.0, zorder=3)
    strength = 1.0 if ahead else 0.75
    gid = f"{prefix}-{row['key']}"
    axes.plot(row["cost"], height, alpha=strength, gid=gid, zorder=3, **style)


def markers(points: pd.DataFrame) -> dict[str, tuple[str, str]]:
    """The marker of each series, shape and fill, no two alike."""
    names = list(points["series"].unique())
    if len(names) > len(MARKERS):
        raise CaseError(f"study.toml: {len(names)} series in a frontier (at most {len(MARKERS)})")
    return dict(zip(names, MARKERS))


def legend(axes, points: pd.DataFrame, more: Sequence = ()):
    """Series by marker, laws by colour, and `more` handles."""
    handles = [
        plt.Line2D([], [], label=name, **look(*marker, "#5d636d"))
        for name, marker in markers(points).items()
    ]
    handles += [
        Patch(color=LAWS[law], label=law.replace("_", " "))
        for law in LAWS
        if law in set(points["law"])
    ]
    grains = (points["engine"] == "dem").any()
    handles += [Patch(color=DEM, label="grains (DEM)")] * int(grains)
    handles += [
        plt.Line2D([], [], ls="none", marker="x", color="#5d636d", label="failed (top edge)")
    ] * int((points["status"] != "ok").any())
    lines = [*handles, *more]
    rows = -(-len(lines) // COLUMNS)
    axes.figure.set_figheight(PLOT + ROW * rows)
    place = {"loc": "upper center", "bbox_to_anchor": (0.47, -0.13)}
    axes.legend(handles=lines, fontsize=7.5, ncols=COLUMNS, **place)


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
