"""A ladder: the error of each rung tried with its interval, against the tolerance."""

from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd

from cases.style import COLOUR, INK
from compare.study.charts import STUDY_STYLE, Picture, save


def draw(tried: list[dict], stop: int | None, metric: str, tolerance: float, path: Path) -> Picture:
    with plt.rc_context(STUDY_STYLE):
        figure, ax = plt.subplots(figsize=(8.0, 0.6 + 0.36 * len(tried)), layout="constrained")
        ax.axvspan(0.0, tolerance, color="#2c7a4b", alpha=0.10, lw=0)
        tips = {}
        for i, one in enumerate(tried):
            if one["verdict"] is None:
                ax.text(tolerance, i, f"  {one['word']}", va="center", color="#b3261e")
                continue
            found, gid = one["verdict"], f"{path.stem}-{i}"
            colour = COLOUR[one["recipe"].engine]
            ax.errorbar(
                found.difference, i, xerr=found.half_width, fmt="none", ecolor=colour, lw=1.2
            )
            ax.plot(
                found.difference,
                i,
                "o",
                color=colour,
                ms=9 if i == stop else 5.5,
                mec=INK if i == stop else colour,
                gid=gid,
            )
            tips[gid] = told(one)
        ax.set_yticks(range(len(tried)), [one["rung"] for one in tried])
        ax.set(
            xlabel=f"error from the grains' mean: {metric}",
            xlim=(0.0, None),
            ylim=(-0.5, len(tried) - 0.5),
        )
        ax.xaxis.set_major_formatter(lambda value, _: f"{100 * value:.3g} %")
        return save(figure, path, tips, data(tried), "; ".join(map(told, tried)) + ".")


def told(one: dict) -> str:
    found = one["verdict"]
    if found is None:
        return f"{one['rung']}: {one['word']}"
    return f"{one['rung']}: {one['word']}, {found.difference:.2%} ± {found.half_width:.2%} off"


def data(tried: list[dict]) -> pd.DataFrame:
    rows = [
        {"rung": one["rung"], "verdict": one["word"]}
        | (
            {"error": one["verdict"].difference, "half_width": one["verdict"].half_width}
            if one["verdict"]
            else {}
        )
        for one in tried
    ]
    return pd.DataFrame(rows)
