"""Figures over the aspect ratio, or the width of a slot: both engines, and what is published."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.artist import Artist

from compare.study.charts import STUDY_STYLE, Picture, save
from compare.study.published import Published

LABELS = {
    "run_out": "run-out $(L_f - L_0)/L_0$",
    "height": "height of the deposit $H_f/L_0$",
    "discharge": "discharge $W/(\\rho_b\\sqrt{g}D^{3/2})$",
}
WORDS = {"run_out": "run-out", "height": "height", "discharge": "discharge"}
PLACES = {"aspect_ratio": ("a", "aspect ratio $a = H/L_0$"), "slot": ("D/d", "slot $D/d$")}
OURS = {"dem": ("grains", "s", "#c46a1b"), "mpm": ("continuum", "o", "#1f5fa8")}
OTHERS = (("-", "P"), ("--", "X"), (":", "D"))  # lines and markers of what is published


def draw(table: pd.DataFrame, published: list[Published], path: Path) -> Picture:
    place = table.columns[0]
    least, most = table[place].min(), table[place].max()
    shown = list(dict.fromkeys(table["figure"]))
    with plt.rc_context(STUDY_STYLE):
        size = (4.0 + 4.0 * len(shown), 4.2)
        figure, row = plt.subplots(1, len(shown), figsize=size, layout="constrained", squeeze=False)
        axes = row[0]
        for ax, name in zip(axes, shown):
            for one, (line, marker) in zip(published, OTHERS):
                for piece in one.laws.get(name, []):
                    a = np.linspace(max(piece.low, least), max(min(piece.high, most), least), 60)
                    ax.plot(a, piece(a), line, color="0.35", lw=1.3, label=one.name)
                if name in one.points:
                    ax.plot(*one.points[name].T, marker, color="0.35", mfc="none", label=one.name)
            rows = table[table["figure"] == name]
            for engine, (word, marker, colour) in OURS.items():
                bars = rows["numerical"] if engine == "mpm" else rows["deviation"].fillna(0.0)
                ax.errorbar(
                    rows[place],
                    rows[engine],
                    yerr=bars,
                    fmt=marker,
                    ms=6,
                    capsize=3,
                    color=colour,
                    label=f"{word}, {'numerical error' if engine == 'mpm' else 'scatter'}",
                )
            ax.set(xlabel=PLACES[place][1], ylabel=LABELS[name], ylim=(0.0, None))
        handles: dict[str, Artist] = {}
        for ax in axes:
            for handle, label in zip(*ax.get_legend_handles_labels()):
                handles.setdefault(label, handle)
        axes[-1].legend(
            handles.values(),
            handles.keys(),
            loc="upper left",
            bbox_to_anchor=(1.02, 1.0),
            frameon=False,
            fontsize=9,
        )
        return save(figure, path, {}, table, told(table))


def told(table: pd.DataFrame) -> str:
    """What the picture shows, in words."""
    place = table.columns[0]
    parts = [
        f"{PLACES[place][0]} = {row[place]:g}: {WORDS[row['figure']]} {row['mpm']:.2f} of the "
        f"continuum, {row['dem']:.2f} of the grains, {row['verdict']}"
        for _, row in table.iterrows()
    ]
    return "; ".join(parts) + "."
