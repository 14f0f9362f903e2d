"""The deviations of collapses over the bias of their laws in the grains' own flow."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib import colormaps

from compare.judge.outcome import HEADLINES, WORDS, Line, regression
from compare.study.charts import STUDY_STYLE, save
from compare.study.page import Figure

MARKERS = "osD^vP*X"
SENTENCES = [
    "Each mark is a law with one set of constants in one scene: its overall bias of μ_D in the "
    "grains' flow, no collapse computed, and what its collapse is off by. The line is the "
    "regression over all whose grains do not roll on a smooth base: hollow marks are of the "
    "others, where continuum and grains do not stand on the same floor.",
]


def draw(table: pd.DataFrame, path: Path) -> Figure:
    scenes, laws = list(table["scene"].unique()), list(table["law"].unique())
    told = regression(table).set_index("headline")
    tips = {}
    with plt.rc_context(STUDY_STYLE):
        figure, axes = plt.subplots(1, len(HEADLINES), figsize=(13.0, 4.4), layout="constrained")
        for ax, name in zip(axes, HEADLINES):
            for i, row in table.iterrows():
                gid = f"{path.stem}-{name}-{i}"
                tips[
                    gid
                ] = f"{row['law']}, {row['scene']}: bias {row['bias']:+.1%}, {row[name]:+.1%}"
                ax.plot(
                    100 * row["bias"],
                    100 * row[name],
                    MARKERS[scenes.index(row["scene"]) % len(MARKERS)],
                    color=colormaps["tab20"](laws.index(row["law"]) % 20),
                    ms=5.5,
                    mfc="none" if row["rolls"] else None,
                    gid=gid,
                )
            span = np.array([table["bias"].min(), table["bias"].max()])
            line = Line(told.loc[name, "at no bias"], told.loc[name, "slope"])
            ax.plot(100 * span, 100 * line.at(span), color="#26292e", lw=1.0)
            ax.axhline(0.0, color="#8a8f98", lw=0.7)
            ax.axvline(0.0, color="#8a8f98", lw=0.7)
            ax.set_title(f"{WORDS[name]}\n{told.loc[name, 'explained']:.0%} explained", fontsize=9)
            ax.set(xlabel="bias of μ_D [%]", ylabel="deviation from the grains [%]")
        told_in_words = "Share of the deviations that the bias explains: " + ", ".join(
            f"{WORDS[name]} {told.loc[name, 'explained']:.0%}" for name in HEADLINES
        )
        marks = [
            plt.Line2D([], [], ls="", marker="o", color=colormaps["tab20"](k % 20), label=law)
            for k, law in enumerate(laws)
        ]
        marks += [
            plt.Line2D([], [], ls="", marker=MARKERS[k % len(MARKERS)], color="#5d636d", label=one)
            for k, one in enumerate(scenes)
        ]
        axes[-1].legend(handles=marks, loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=7.5)
        return (
            "Bias against outcome",
            list(SENTENCES),
            save(figure, path, tips, table, told_in_words),
        )
