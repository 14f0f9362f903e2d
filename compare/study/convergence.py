"""Do the numerics decide the result? Settings that should not matter, against the scatter of runs
that differ by nothing.

The table [convergence] of a case's study.toml holds groups; a group is a setting of the case,
`runs` copies of it whose points are displaced by 1e-10 of their spacing, and the changes that it is
tried with. A granular flow is chaotic: what a change of the numerics does is seen above that
scatter only.
"""

from dataclasses import replace

import numpy as np
import pandas as pd

from compare.study.figures import JITTER
from compare.study.recipe import Recipe, assignment
from compare.verdict.equivalence import equivalence

BASE = "as it is"
LESS, MORE = "within limit", "beyond limit"


def plan(study: dict) -> list[dict]:
    """The settings: group, name, the group's limits and this one's, and the recipes of its runs."""
    settings = []
    for group in study["group"]:
        runs = group.get("runs", 1)
        jitter = [f"mpm.jitter={JITTER:g}"] if runs > 1 else []
        for change in [{"name": BASE}, *group.get("change", [])]:
            sets = [
                assignment(key, value)
                for table in (study.get("set", {}), group.get("set", {}), change.get("set", {}))
                for key, value in table.items()
            ]
            recipe = Recipe("mpm", tuple(sets + jitter), change["name"], study["timeout"])
            settings.append(
                {
                    "group": group["name"],
                    "name": change["name"],
                    "limits": change.get("limits", {}),
                    "at_most": study.get("at_most", {}) | change.get("at_most", {}),
                    "recipes": [replace(recipe, seed=seed) for seed in range(1, runs + 1)],
                }
            )
    return settings


def table(settings: list[dict], found: list[list[dict]]) -> pd.DataFrame:
    """A row for each figure of each setting: mean and standard deviation of its runs; where it has
    a limit, the change from the group's base relative to the base's mean with the half-width of its
    90 % interval, or the mean itself, and the verdict.
    """
    rows: list[dict] = []
    base: list[dict] = []
    for setting, runs in zip(settings, found):
        if setting["name"] == BASE:
            base = runs
        for figure in (name for name, value in runs[0].items() if isinstance(value, (int, float))):
            values, others = (
                np.array([one[figure] for one in sample], dtype=np.float64)
                for sample in (runs, base)
            )
            row = {
                "group": setting["group"],
                "setting": setting["name"],
                "settings": " ".join(setting["recipes"][0].sets),
                "figure": figure,
                "mean": values.mean(),
                "deviation": values.std(ddof=1) if len(values) > 1 else float("nan"),
                "runs": len(values),
            }
            if figure in setting["limits"]:
                scale = abs(others.mean())
                verdict = equivalence(values / scale, others / scale, setting["limits"][figure])
                row |= {
                    "change": verdict.difference,
                    "half_width": verdict.half_width,
                    "limit": verdict.margin,
                    "verdict": verdict.word,
                }
            elif figure in setting["at_most"]:
                limit = setting["at_most"][figure]
                row |= {"limit": limit, "verdict": LESS if values.mean() <= limit else MORE}
            rows.append(row)
    return pd.DataFrame(rows)
