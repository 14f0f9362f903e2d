"""Columns of published aspect ratios, or silos of published slots, run by both engines and held
against each other and against what is published.

The table [experiment] of a case's study.toml names the aspect ratios, and the case's length stays
while its height follows; or it names the widths of the slots. The grains scatter by their packings,
the continuum's figures have the bar that its siblings tell.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from cases.case import Case, load
from cases.errors import CaseError
from cases.scenes import is_silo
from compare.study.deposit import definitions
from compare.study.published import Published, band
from compare.study.recipe import Recipe, assignment
from compare.verdict.comparison import margin_in
from compare.verdict.equivalence import equivalence


MARGIN_DISCHARGE = 0.05  # relative, as those of run-out and height are


@dataclass(frozen=True)
class Column:
    """The runs of one aspect ratio, or of one slot, its width in grains."""

    place: float
    mpm: Recipe
    dem: list[Recipe]

    @property
    def recipes(self) -> list[Recipe]:
        return [self.mpm, *self.dem]


def plan(scene: Case, study: dict) -> list[Column]:
    silo = is_silo(scene["geometry"])
    wanted = study.get("slots" if silo else "aspect_ratios")
    if not wanted:
        what = "slots" if silo else "aspect_ratios"
        raise CaseError(f"{scene.path.with_name('study.toml')}: [experiment] has no {what}")
    columns = []
    for place in wanted:
        if silo:
            key, value = "geometry.orifice", 0.5 * place * scene["grains.diameter"]
        else:
            key, value = "geometry.height", place * scene["geometry.length"]
        more = [assignment(*one) for one in study.get("set", {}).items()]
        sets = (*more, assignment(key, value))
        words = f"{'D/d' if silo else 'a'} = {place:g}"
        columns.append(
            Column(
                place,
                Recipe("mpm", sets, words, study["timeout"]),
                [
                    Recipe("dem", sets, words, study["timeout"], seed)
                    for seed in range(1, study["packings"] + 1)
                ],
            )
        )
    return columns


def place_of(scene: Case) -> str:
    """What the columns differ by, as a table calls it."""
    return "slot" if is_silo(scene["geometry"]) else "aspect_ratio"


def table(
    scene: Case, columns: list[Column], found: list[list[dict]], published: list[Published]
) -> pd.DataFrame:
    """A row for each figure of each column; all lengths in L0."""
    rows, of = [], place_of(scene)
    for column, (mpm, *dem) in zip(columns, found):
        here = load(scene.path, column.mpm.sets)
        for figure in definitions(scene):
            grains = np.array([one[figure] for one in dem])
            verdict = equivalence(
                [mpm[figure]],
                grains,
                margin(here, figure, grains.mean()),
                numerical=mpm[f"{figure}_numerical"],
            )
            low, high = band(published, figure, column.place) or (np.nan, np.nan)
            rows.append(
                {
                    of: column.place,
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


def margin(here: Case, figure: str, mean: float) -> float:
    """Within which a figure of that `mean` is the same."""
    if figure == "discharge":
        return MARGIN_DISCHARGE * mean
    return margin_in(here, f"compare.margin_{figure}", mean, here["grains.diameter"])
