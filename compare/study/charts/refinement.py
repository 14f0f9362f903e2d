"""Refinement: how far the next finer cells move the deposit of each law, what its distance from the
finest one costs, and the fluctuation energy with and without what lies within a grain of the base.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd

from compare.study.charts import STUDY_STYLE, Picture, save
from compare.study.charts.frontier import LAWS


def draw(table: pd.DataFrame, path: Path) -> Picture:
    with plt.rc_context(STUDY_STYLE):
        figure, (moves, costs, holds) = plt.subplots(
            1, 3, figsize=(12.0, 4.0), layout="constrained"
        )
        for law, part in table.groupby("law", sort=False):
            colour = LAWS[str(law)]
            mean = part.groupby("cells").mean(numeric_only=True)
            word = str(law).replace("_", " ")
            moves.plot(mean.index, mean["to_next"], "o-", color=colour)
            moves.plot(mean.index, mean["apart"], ":", color=colour, lw=1.0)
            costs.plot(
                mean["cpu_seconds_engine"], mean["to_finest"], "o-", color=colour, label=word
            )
            finest = mean.iloc[-1]
            if finest["fluctuation"] > 0.0:
                for name, line in (("fluctuation", "o-"), ("fluctuation_above", "o--")):
                    holds.plot(mean.index, mean[name] / finest[name], line, color=colour)
        cells = sorted(table["cells"].unique())
        for ax in (moves, holds):
            ax.set_xscale("log", base=2)
            ax.set_xticks(cells, [str(count) for count in cells])
            ax.set_xlabel("cells in the height")
        moves.set(yscale="log", ylabel="deposit moved by the next finer cells [L0]")
        costs.set(xscale="log", yscale="log", xlabel="processor time [s]")
        costs.set_ylabel("distance from the finest deposit [L0]")
        holds.set_ylabel("largest fluctuation energy, over the finest's")
        holds.set_ylim(0.0, None)
        costs.legend(frameon=False, fontsize=9, loc="lower left")
        moves.plot([], [], "k:", lw=1.0, label="two starts apart")
        moves.legend(frameon=False, fontsize=9, loc="lower right")
        holds.plot([], [], "k-", label="all")
        holds.plot([], [], "k--", label="above a grain's diameter")
        holds.legend(frameon=False, fontsize=9, loc="lower right")
        return save(figure, path, {}, table, told(table))


def told(table: pd.DataFrame) -> str:
    """The chart in words."""
    parts = []
    for law, part in table.groupby("law", sort=False):
        moved = part.groupby("cells")["to_next"].mean().dropna()
        steps = ", ".join(f"{count} cells {value:.3g}" for count, value in moved.items())
        parts.append(f"{law} moved by the next finer cells: {steps} L0")
    return "; ".join(parts) + "."
