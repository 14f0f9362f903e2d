"""Stability maps: every run by its class, the measured boundary, claimed limit and default."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from cases.style import INK
from compare.report.charts import ticks
from compare.study.charts import STUDY_STYLE, Picture, save
from compare.study.atlas import default_of, limit, relaxation_limit, sentences, table
from compare.study.quantities import label

CLASSES = {
    "ok": ("o", "#2c7a4b"),
    "energy growth": ("^", "#b3261e"),
    "energy drift": ("v", "#d9730d"),
    "ejected points": ("D", "#7b4ea3"),
    "inverted volume": ("s", "#8a5a00"),
    "not a number": ("X", "#26292e"),
    "timeout": ("P", "#5d636d"),
    "lost grains": ("D", "#7b4ea3"),
    "inaccurate": ("v", "#d9730d"),
    "refused": ("x", "#5d636d"),
    "engine failure": ("x", "#26292e"),
}


def draw(planes: list[dict], rows: list[list], scene, path: Path) -> Picture:
    columns = 3
    with plt.rc_context(STUDY_STYLE):
        lines = -(-len(planes) // columns)
        figure, axes = plt.subplots(  # the last line is the legend's
            lines + 1,
            columns,
            figsize=(11.0, 3.0 * lines + 1.0),
            squeeze=False,
            layout="constrained",
            height_ratios=[3.0] * lines + [0.8],
        )
        tips: dict[str, str] = {}
        for n, (ax, plane) in enumerate(zip(axes.ravel(), planes)):
            tips |= draw_runs(ax, plane, rows[n], f"{path.stem}-{n}")
            draw_limits(ax, plane, rows[n], scene)
        for ax in axes.ravel()[len(planes) :]:
            ax.set_axis_off()
        seen = {run["status"] for found in rows for _, row in found for run in row["runs"]}
        handles = [
            plt.Line2D(
                [], [], ls="none", marker=CLASSES[name][0], color=CLASSES[name][1], label=name
            )
            for name in CLASSES
            if name in seen
        ]
        handles += [
            plt.Line2D(
                [],
                [],
                ls="none",
                marker="o",
                color="white",
                mec=CLASSES["ok"][1],
                label="ok, with a warning",
            ),
            plt.Line2D([], [], color=INK, label="measured boundary"),
            plt.Line2D([], [], color="#1f5fa8", ls="--", label="claimed limit"),
            plt.Line2D([], [], color="#b0367a", ls="-.", label="relaxation of temperature"),
            plt.Line2D([], [], color="#8a8f98", ls=":", label="default"),
        ]
        middle = axes[-1, columns // 2]
        middle.legend(handles=handles, loc="center", ncols=5, fontsize=8.5).set_in_layout(False)
        words = [
            f"{plane['name']}: {'; '.join(sentences(plane, found, scene))}."
            for plane, found in zip(planes, rows)
        ]
        return save(figure, path, tips, table(planes, rows, scene), " ".join(words))


def draw_runs(ax, plane: dict, rows: list, prefix: str) -> dict[str, str]:
    """Every run of a plane as a marker of its class; returns what each tells, by its gid."""
    tips = {}
    for height, (value, row) in enumerate(rows):
        for k, run in enumerate(row["runs"]):
            marker, colour = CLASSES[run["status"]]
            warned = run["status"] == "ok" and run.get("warnings", "none") != "none"
            gid = f"{prefix}-{height}-{k}"
            ax.plot(
                run["value"],
                height,
                marker,
                color="white" if warned else colour,
                mec=colour,
                ms=5.5,
                gid=gid,
            )
            tips[gid] = (
                f"{run['status']} at {plane['along']} = {run['value']:.4g}, "
                f"{plane['across']} = {value}\n"
                f"{run.get('message', '')} {run.get('warnings', '')}\n{run.get('command', '')}"
            )
    return tips


def draw_limits(ax, plane: dict, rows: list, scene):
    """The measured boundary over a plane's rows, the limits that are claimed, and the default."""
    heights = np.arange(len(rows))
    products = [row["good"] * row["bad"] for _, row in rows]
    between = [np.sqrt(product) if np.isfinite(product) else np.nan for product in products]
    claimed = [limit(plane, value, scene) for value, _ in rows]
    relaxation = [relaxation_limit(plane, value, scene) for value, _ in rows]
    ax.plot(between, heights, "-", color=INK, lw=1.4, zorder=1)
    ax.plot(claimed, heights, "--", color="#1f5fa8", lw=1.4, zorder=1)
    ax.plot(relaxation, heights, "-.", color="#b0367a", lw=1.4, zorder=1)
    ax.axvline(default_of(plane, scene), color="#8a8f98", ls=":", lw=1.4, zorder=1)
    ax.set(xscale="log", title=plane["name"], xlabel=label(plane["along"]))
    ax.set_yticks(heights, [f"{value:g}" for value, _ in rows])
    ax.set_ylabel(label(plane["across"], width=32))
    ticks(ax.xaxis, *plane["between"])


def draw_trends(trends, path: Path) -> Picture:
    """Damping by the numerics over the step, one line per scheme."""
    with plt.rc_context(STUDY_STYLE):
        figure, ax = plt.subplots(figsize=(6.0, 3.4), layout="constrained")
        for name, rows in trends.groupby("trend", sort=False):
            ax.loglog(rows["value"], rows["damping"], "o-", label=name)
        ax.set(
            xlabel=label(trends["key"].iloc[0]),
            ylabel="energy lost\n/ ∫ kinetic energy dt [1/√(H/g)]",
        )
        for axis, values in ((ax.xaxis, trends["value"]), (ax.yaxis, trends["damping"])):
            ticks(axis, values.min(), values.max())
        ax.legend(fontsize=8)
        return save(figure, path, {}, trends.drop(columns="command"))
