"""Figures of a chute: profiles of both sides over the depth, and how they came there."""

from math import tan, radians
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.artist import Artist

from cases.case import Case
from compare.chute import published
from compare.chute.sides import Side, units
from compare.study.charts import STUDY_STYLE, Picture, save

COLOURS = {"dem": "#c46a1b", "mpm": "#1f5fa8"}
WORDS = {"dem": "grains", "mpm": "continuum"}


def draw(found: list[Side], path: Path) -> Picture:
    """Solid fraction, velocity, temperature, stress ratio and balance of both sides."""
    case = found[0].run.case
    unit, angle = units(case), case["geometry.inclination"]
    with plt.rc_context(STUDY_STYLE):
        figure, axes = plt.subplots(1, 5, figsize=(14.0, 4.2), sharey=True, layout="constrained")
        for side in found:
            flow, colour = side.flow, COLOURS[side.run.engine]
            c, y = flow.columns, flow.y / unit["length"]
            label = f"{WORDS[side.run.engine]} ({flow.name}), {flow.state}"
            there = c["solid_fraction"] > 0.02
            with np.errstate(divide="ignore", invalid="ignore"):
                ratio = c["temperature"] / (c["shear_rate"] * unit["length"]) ** 2
                friction = c["shear"] / c["normal"]
                base = c["weight"].max()
                normal = (c["normal"] - c["weight"]) / base
                shear = (c["shear"] - c["drive"]) / (c["drive"].max() or np.nan)
            style = {"color": colour, "lw": 1.5}
            axes[0].plot(c["solid_fraction"][there], y[there], label=label, **style)
            axes[1].plot(c["velocity"][there] / unit["velocity"], y[there], **style)
            axes[2].plot(np.where(flow.core, ratio, np.nan), y, **style)
            axes[3].plot(np.where(flow.bulk, friction, np.nan), y, **style)
            axes[4].plot(np.where(flow.bulk, 100 * normal, np.nan), y, **style)
            axes[4].plot(np.where(flow.bulk, 100 * shear, np.nan), y, ls=":", **style)
        axes[3].axvline(tan(radians(angle)), color="0.4", lw=1.0, ls="--")
        inertial = found[-1].flow.figures["inertial_number"]
        for one in published.at(angle, inertial if np.isfinite(inertial) else 0.0):
            if one.figure == "solid_fraction":
                axes[0].axvline(one.value, color="0.4", lw=1.0, ls="--", label=one.name)
        axes[4].axvspan(-1, 1, color="0.9", zorder=0)
        for ax, words in zip(
            axes,
            (
                "solid fraction",
                "$v/\\sqrt{gd}$",
                "$T/(\\dot\\gamma d)^2$ of the core",
                "$\\sigma_{xy}/\\sigma_{yy}$",
                "normal (—), shear (···) off [%]",
            ),
        ):
            ax.set_xlabel(words)
        axes[0].set(ylabel="$y/d$", ylim=(0.0, None), xlim=(0.0, 0.7))
        beside(axes[-1], *axes[0].get_legend_handles_labels())
        return save(figure, path, {})


def beside(ax, handles: list[Artist], labels: list[str]):
    """The legend of a row of panels, to the right of the last."""
    ax.legend(
        handles,
        labels,
        loc="upper left",
        bbox_to_anchor=(1.02, 1.0),
        frameon=False,
        fontsize=9,
    )


def start(found: list[Side], path: Path) -> Picture:
    """The mean velocity over time, from rest."""
    unit = units(found[0].run.case)
    with plt.rc_context(STUDY_STYLE):
        figure, ax = plt.subplots(figsize=(7.0, 3.2), layout="constrained")
        for side in found:
            time = side.run.time * unit["rate"]
            label = f"{WORDS[side.run.engine]} ({side.flow.name})"
            ax.plot(
                time, side.velocity / unit["velocity"], color=COLOURS[side.run.engine], label=label
            )
        ax.set(xlabel="$t\\sqrt{g/d}$", ylabel="mean $v/\\sqrt{gd}$", ylim=(0.0, None))
        ax.legend(frameon=False, fontsize=9)
        return save(figure, path, {})


def steady(table: pd.DataFrame, path: Path) -> Picture:
    """Figures of the grains and of every law over the inclination."""
    shown = {
        "solid_fraction": "solid fraction",
        "inertial_number": "inertial number",
        "temperature_ratio": "$T/(\\dot\\gamma d)^2$",
        "stress_ratio": "$\\sigma_{xy}/\\sigma_{yy}$",
    }
    with plt.rc_context(STUDY_STYLE):
        figure, axes = plt.subplots(1, 4, figsize=(14.0, 3.8), layout="constrained")
        table = table.assign(law=table["law"].fillna(""))  # as a file has that of grains
        deepest = table.groupby(["engine", "law", "inclination"])["height"].transform("median")
        rows = table[table["height"] == deepest]
        for (engine, law), part in rows.groupby(["engine", "law"], dropna=False):
            colour = COLOURS["dem"] if engine == "dem" else None
            flows = part["state"].str.contains("steady")  # some of its packings are
            for ax, name in zip(axes, shown):
                line = ax.plot(
                    part["inclination"],
                    part[name],
                    "s-" if engine == "dem" else "o-",
                    color=colour,
                    lw=1.0,
                    ms=5,
                    label=WORDS["dem"] if engine == "dem" else law,
                )
                if f"{name}_deviation" in part:  # the scatter, where there are several packings
                    known = part[part[f"{name}_deviation"].notna()]
                    if len(known):
                        bars = known[f"{name}_deviation"]
                        ax.errorbar(known["inclination"], known[name], bars, fmt="none", color="k")
                ax.plot(  # figures of what is not steady are open
                    part["inclination"][~flows],
                    part[name][~flows],
                    "s" if engine == "dem" else "o",
                    color="white",
                    mec=line[0].get_color(),
                    ms=5,
                )
        dem = rows[rows["engine"] == "dem"].sort_values("inclination")
        for ax, name in zip(axes, shown):
            if f"published_{name}" in dem:
                ax.plot(
                    dem["inclination"],
                    dem[f"published_{name}"],
                    "k--",
                    lw=1.0,
                    label="published",
                )
            ax.set(xlabel="inclination [°]", ylabel=shown[name])
        angles = np.linspace(table["inclination"].min(), table["inclination"].max(), 50)
        axes[3].plot(angles, np.tan(np.radians(angles)), "k:", lw=1.0, label="tangent")
        axes[2].set(ylim=(0.0, None))
        names: dict[str, Artist] = {}
        for ax in axes:
            for handle, label in zip(*ax.get_legend_handles_labels()):
                names.setdefault(label, handle)
        beside(axes[-1], list(names.values()), list(names))
        return save(figure, path, {})


def thresholds(table: pd.DataFrame, scene: Case, path: Path) -> Picture:
    """The velocity that layers come to, from rest and from flow, over the inclination."""
    unit = units(scene)["velocity"]
    with plt.rc_context(STUDY_STYLE):
        figure, ax = plt.subplots(figsize=(7.4, 3.6), layout="constrained")
        for (engine, begins), part in table.groupby(["engine", "begins"]):
            law = part["law"].iloc[0]
            flowing = begins != "rest"
            ax.plot(
                part["inclination"],
                part["velocity_at_end"] / unit,
                "o-" if flowing else "s--",
                color=COLOURS[engine],
                mfc=COLOURS[engine] if flowing else "white",
                lw=1.0,
                ms=5,
                label=f"{WORDS[engine]}{f', {law}' if law else ''}, "
                + (f"begun at {begins}" if flowing else "from rest"),
            )
        ax.set(xlabel="inclination [°]", ylabel="mean $v/\\sqrt{gd}$ at the end")
        ax.legend(frameon=False, fontsize=9)
        return save(figure, path, {})
