"""Columns of published aspect ratios, run by both engines and held against each other and against
what is published.

The table [experiment] of a case's study.toml names the aspect ratios; the case's length stays, its
height follows. The grains scatter by their packings, the continuum's figures have the bar that its
siblings tell.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from cases.case import Case, load
from compare.study.deposit import DEFINITIONS
from compare.study.published import Published, band
from compare.study.recipe import Recipe, assignment
from compare.verdict.comparison import margin_in
from compare.verdict.equivalence import equivalence


@dataclass(frozen=True)
class Column:
    """The runs of one aspect ratio."""

    aspect_ratio: float
    mpm: Recipe
    dem: list[Recipe]

    @property
    def recipes(self) -> list[Recipe]:
        return [self.mpm, *self.dem]


def plan(scene: Case, study: dict) -> list[Column]:
    columns = []
    for a in study["aspect_ratios"]:
        height = assignment("geometry.height", a * scene["geometry.length"])
        more = [assignment(key, value) for key, value in study.get("set", {}).items()]
        sets = (*more, height)
        columns.append(
            Column(
                a,
                Recipe("mpm", sets, f"a = {a:g}", study["timeout"]),
                [
                    Recipe("dem", sets, f"a = {a:g}", study["timeout"], seed)
                    for seed in range(1, study["packings"] + 1)
                ],
            )
        )
    return columns


def table(
    scene: Case, columns: list[Column], found: list[list[dict]], published: list[Published]
) -> pd.DataFrame:
    """A row for each figure of each column; all lengths in L0."""
    rows = []
    for column, (mpm, *dem) in zip(columns, found):
        here = load(scene.path, column.mpm.sets)
        for figure in DEFINITIONS:
            grains = np.array([one[figure] for one in dem])
            verdict = equivalence(
                [mpm[figure]],
                grains,
                margin_in(here, f"compare.margin_{figure}", grains.mean(), here["grains.diameter"]),
                numerical=mpm[f"{figure}_numerical"],
            )
            low, high = band(published, figure, column.aspect_ratio) or (np.nan, np.nan)
            rows.append(
                {
                    "aspect_ratio": column.aspect_ratio,
                    "figure": figure,
                    "mpm": mpm[figure],
                    "numerical": mpm[f"{figure}_numerical"],
                    "dem": grains.mean(),
                    "deviation": grains.std(ddof=1) if len(grains) > 1 else np.nan,
                    "packings": len(grains),
                    "half_width": verdict.half_width,
                    "margin": verdict.margin,
                    "verdict": verdict.word,
                    "published_least": low,
                    "published_most": high,
                    "mpm_cpu_seconds": mpm["cpu_seconds_engine"],
                    "dem_cpu_seconds": np.mean([one["cpu_seconds_engine"] for one in dem]),
                    "settings": " ".join(column.mpm.sets),
                }
            )
    return pd.DataFrame(rows)
