"""The least model that does: rungs from cheap to dear, climbed until one agrees with the grains and
the next one too.
"""

import numpy as np

from compare.verdict import equivalence as verdict
from cases.case import Case, load
from cases.errors import CaseError
from cases.programs import ROOT
from compare.study.frontier import times_cheaper
from compare.study.recipe import Recipe, assignment
from compare.study.distance import cost
from compare.study.measure import COLLAPSE, Measure


UNKNOWN = "not known"
STEADY = "steady"


def rungs(scene: Case) -> list[tuple[str, Recipe]]:
    """Name and recipe of each rung, of the case's own [ladder] or of cases/ladder.toml."""
    files = [scene.path.with_name("study.toml"), ROOT / "cases" / "ladder.toml"]
    for file in files:
        table = load(file, kind="study").values.get("ladder") if file.exists() else None
        if table:
            return [
                (rung["name"], recipe_of(rung, table["timeout"], scene)) for rung in table["rung"]
            ]
    raise CaseError(f"{files[-1]}: no table [ladder]")


def recipe_of(rung: dict, timeout: float, scene: Case) -> Recipe:
    """`cells` becomes a cell size: of the shorter side of the column, and in three dimensions a
    divisor of the thickness.
    """
    sets = [assignment(key, value) for key, value in rung.get("set", {}).items()]
    if "cells" in rung:
        size = min(scene["geometry.height"], scene["geometry.length"]) / rung["cells"]
        if rung.get("set", {}).get("geometry.dimension") == "three_dimensional":
            size = scene["geometry.thickness"] / max(1, round(scene["geometry.thickness"] / size))
        sets.append(f"mpm.cell_size={size:.8g}")
    return Recipe(rung["engine"], tuple(sets), rung["name"], timeout)


def judge(
    point: dict,
    reference: dict,
    metric: str,
    tolerance: float,
    scene: Case,
    by: Measure = COLLAPSE,
) -> verdict.Verdict | None:
    """Whether a run's error from the mean of the grains lies within the tolerance, given how few
    seeds that mean is of.

    The seeds' scatter enters by the jackknife: with d the error from the mean of all n seeds and
    d_i that without seed i, the pseudo-values n d - (n - 1) d_i have the mean and the scatter of d
    [Tukey 1958]; they go through the test of every other verdict. None for a run that failed, or
    that does not tell the metric.
    """
    if point["status"] != "ok":
        return None
    members = reference["members"]
    n, whole = len(members), by.errors(point, reference["mean"], scene)[metric]
    if np.isnan(whole):
        return None
    without = [
        by.errors(point, by.mean(members[:i] + members[i + 1 :], scene), scene)[metric]
        for i in range(n)
    ]
    return verdict.distance(n * whole - (n - 1) * np.array(without), tolerance)


def climb(ladder, run, judged, flight: int = 4) -> tuple[list[dict], int | None]:
    """Climbs until a rung agrees and the next one does too; returns the rungs tried and the index
    of that rung.

    run(recipes) -> points, asked for `flight` rungs at a time; judged(point) -> Verdict or None.
    The top rung needs nothing above it.
    """
    tried: list[dict] = []
    points: list[dict] = []
    for i, (name, recipe) in enumerate(ladder):
        if i == len(points):
            points += run([recipe for _, recipe in ladder[i : i + flight]])
        point = points[i]
        found = judged(point)
        word = found.word if found else unjudged(point)
        tried.append(
            {"rung": name, "recipe": recipe, "point": point, "word": word, "verdict": found}
        )
        agrees = [one["word"] == verdict.AGREE for one in tried[-2:]]
        if len(tried) > 1 and all(agrees):
            return tried, i - 1
        if agrees[-1] and i == len(ladder) - 1:
            return tried, i
    return tried, None


def unjudged(point: dict) -> str:
    """Why a point has no verdict: how its run failed, or of a flow what it does in place of being
    steady.
    """
    if point["status"] != "ok":
        return point["status"]
    state = point.get("state", STEADY)
    return UNKNOWN if state == STEADY else state


def paragraph(
    tried: list[dict], stop: int | None, ladder, reference: dict, metric: str, tolerance: float
) -> str:
    """What was not needed, what was, and the factor saved."""
    if stop is None:
        ran = [one for one in tried if one["verdict"]]
        if not ran:
            return f"No rung can be held against the grains in the {metric}: none came so far."
        nearest = min(ran, key=lambda one: one["verdict"].difference)
        return (
            f"No rung agrees with the grains within {tolerance:.0%} of the {metric}; the nearest "
            f"is {nearest['rung']}, {nearest['verdict'].difference:.1%} ± "
            f"{nearest['verdict'].half_width:.1%} off."
        )
    chosen = tried[stop]
    price = cost(chosen["point"])
    lower = [
        f"{one['rung']} ({one['verdict'].difference:.1%})"
        if one["verdict"]
        else f"{one['rung']} ({one['word']})"
        for one in tried[:stop]
    ]
    above = [name for name, _ in ladder[stop + 1 :]]
    said = (
        f"Enough: {chosen['rung']}, {chosen['verdict'].difference:.1%} ± "
        f"{chosen['verdict'].half_width:.1%} off in the {metric}, at {price:.2g} s per √(H/g), "
        f"{times_cheaper(price, reference)}"
    )
    if stop + 1 < len(tried):
        said += f"; one rung up ({tried[stop + 1]['rung']}) agrees as well"
    said += ". " + (f"Not enough: {', '.join(lower)}. " if lower else "Nothing cheaper was tried. ")
    return said + (
        f"Not needed: {', '.join(above)}."
        if above
        else "Nothing above it would have been left out."
    )
