"""Speed against accuracy: the points of a frontier, their front, and what it says in words."""

import json
import math

import numpy as np
import pandas as pd

from cases.case import Case
from cases.programs import ROOT
from compare.study.recipe import Recipe
from compare.study.distance import cost, errors
from compare.verdict import siblings

LEVELS = (0.02, 0.05, 0.10)
NUMERICAL_LEVELS = (0.01, 0.02)
KEYS = {
    "law": "material.law",
    "card": "material.card",
    "cell_size": "mpm.cell_size",
    "points_per_cell": "mpm.points_per_cell",
    "transfer": "mpm.transfer",
    "velocity_relaxation": "mpm.velocity_relaxation",
    "void_ratio_relaxation": "mpm.void_ratio_relaxation",
    "shape": "mpm.shape",
    "stress_update": "mpm.stress_update",
    "averaging": "mpm.volumetric_averaging",
    "integrator": "material.integrator",
    "dimension": "geometry.dimension",
    "time_step_fraction": "mpm.time_step_fraction",
    "coarsening": "dem.coarsening",
    "young_modulus": "dem.young_modulus",
    "dem_time_step_fraction": "dem.time_step_fraction",
}


def table(points: list[dict], fine: list[dict], reference: dict, scene: Case) -> pd.DataFrame:
    """One row per point: its recipe, cost [s per sqrt(H/g)], status, `error_*` from the grains'
    mean, `bar_*`, what of it the numerics may be, `numerical_*` from the fine-grid solution of the
    same law and card, and the share of moving points without stress; NaN where there is none.
    """
    limits = {
        tuple(value_of(point, KEYS[key], scene) for key in ("law", "card")): point
        for point in fine
        if point["status"] == "ok"
    }
    rows = []
    for point in points + [limit | {"fine": True} for limit in fine]:
        recipe = Recipe.of(point["recipe"])
        ours = [
            key
            for key in KEYS
            if KEYS[key].startswith(
                ("dem" if recipe.engine == "mpm" else ("mpm", "material", "geom"))
            )
        ]
        row = {
            "key": point["key"],
            "engine": recipe.engine,
            "series": recipe.series,
            "label": recipe.label,
            "status": point["status"],
            "fine": point.get("fine", False),
        }
        row |= {
            name: "" if name in ours else value_of(point, key, scene) for name, key in KEYS.items()
        }
        row |= {
            "warnings": point.get("warnings", "none"),
            "cpu_seconds": point["cpu_seconds"],
            "cost": math.nan,
            "steps": math.nan,
            "duration": math.nan,
            "moving_without_stress": math.nan,
        }
        if point["status"] == "ok":
            row |= {"cost": cost(point), "steps": point["steps"], "duration": point["tau"][-1]}
            row |= {"moving_without_stress": point.get("moving_without_stress", math.nan)}
            row |= {
                f"error_{name}": value
                for name, value in errors(point, reference["mean"], scene).items()
            }
            row |= {f"bar_{name}": value for name, value in bars(point, scene).items()}
            limit = limits.get((row["law"], row["card"]))
            if limit and not row["fine"]:
                row |= {
                    f"numerical_{name}": value
                    for name, value in errors(point, limit, scene).items()
                }
        row |= {
            "message": point.get("message", ""),
            "commit": point.get("commit", ""),
            "command": recipe.command(scene.path.parent),
        }
        rows.append(row)
    return pd.DataFrame(rows)


def bars(point: dict, scene: Case) -> dict[str, float]:
    """The numerical error bar of each of the errors (compare/verdict/siblings.py), with distances
    between runs in place of differences; empty for grains and where a sibling failed.
    """
    found = point.get("siblings", {})
    if not found or any(one["status"] != "ok" for one in found.values()):
        return {}
    coarse, slow = (errors(point, found[name], scene) for name in ("coarse", "slow"))
    return {name: siblings.bar(coarse[name], slow[name]) for name in coarse}


def value_of(point: dict, key: str, scene: Case):
    """What the recipe, else the case, gives to a key."""
    told = Recipe.of(point["recipe"])[key]
    return scene[key] if told is None else told


def committed(name: str) -> tuple[pd.DataFrame, dict]:
    """The points of a case's frontier and the grains they are held against, as they are kept."""
    folder = ROOT / "cases" / name / "reference"
    points = pd.read_csv(folder / "frontier" / "points.csv", comment="#")
    return points, json.loads((folder / "grains.json").read_text())


def on_cells(points: pd.DataFrame, size: float) -> pd.DataFrame:
    """Every law and card that ended well on cells of `size` [m], nothing else changed."""
    return points[
        points["series"].str.contains("cell size")
        & (points["status"] == "ok")
        & (points["engine"] == "mpm")
        & ~points["fine"]
        & ((points["cell_size"] - size).abs() < 1e-9)
    ]


def front(costs, values) -> np.ndarray:
    """Indices, in order of cost, of the points that no other point beats in both."""
    order = np.lexsort((values, costs))
    kept, best = [], math.inf
    for i in order:
        if values[i] < best:
            kept.append(i)
            best = values[i]
    return np.array(kept, dtype=int)


def grain_cost(reference: dict) -> float:
    """Processor seconds per sqrt(H/g) of the engine's own steps, of the grains as the case has
    them: mean over the seeds; NaN where these do not tell it.
    """
    return float(np.mean([cost(member) for member in reference["members"]]))


def times_cheaper(price: float, reference: dict) -> str:
    """How many times cheaper than the grains a price per sqrt(H/g) is, in words."""
    if price == 0.0:
        return "too short a run for the processor's clock"
    times = grain_cost(reference) / price
    if math.isnan(times):
        return (
            "the grains' cost is not known (these were kept before files told the engine's own "
            "time) make them again, with --seeds 8"
        )
    return f"{times:.0f} times cheaper than the grains"


def band(reference: dict, name: str) -> float:
    """The largest error of a seed against the mean of the others: below it a point is one seed
    more.
    """
    return max(reference["scatter"][name])


def cheapest(points: pd.DataFrame) -> pd.Series | None:
    """Of what is no fine solution."""
    good = points[~points["fine"]]
    return None if good.empty else good.loc[good["cost"].idxmin()]


def best(points: pd.DataFrame, name: str, level: float) -> pd.Series | None:
    """The cheapest point whose error is at most `level`."""
    return cheapest(points[(points["status"] == "ok") & (points[f"error_{name}"] <= level)])


def converged(points: pd.DataFrame, law: str, card: str, level: float) -> pd.Series | None:
    """The cheapest recipe of a law whose deposit and run-out are within `level` of the law's own
    fine solution.
    """
    own = points[(points["law"] == law) & (points["card"].fillna("") == card)]
    near = (own["numerical_deposit"] <= level) & (own["numerical_run_out"] <= level)
    return cheapest(own[near])


def sentences(points: pd.DataFrame, reference: dict, name: str) -> list[str]:
    """What the chart of one metric says: the best recipe at each level and how many times cheaper
    than the grains it is.
    """
    out = []
    for level in LEVELS:
        found = best(points, name, level)
        if found is None:
            continuum = points[
                (points["engine"] == "mpm")
                & (points["status"] == "ok")
                & ~points["fine"]
                & points[f"error_{name}"].notna()
            ]
            nearest = continuum.loc[continuum[f"error_{name}"].idxmin()] if len(continuum) else None
            tail = (
                ""
                if nearest is None
                else (
                    f"; the continuum's nearest, {nearest['label']}, is "
                    f"{nearest[f'error_{name}']:.1%} off"
                )
            )
            out.append(f"{level:.0%}: no recipe but the grains themselves{tail}")
        else:
            out.append(
                f"{level:.0%}: {found['engine'].upper()} {found['label']} "
                f"({found[f'error_{name}']:.1%} off) at {found['cost']:.2g} s per √(H/g), "
                f"{times_cheaper(found['cost'], reference)}"
            )
    return out
