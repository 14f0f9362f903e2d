"""What the studies state: by their tables, and measured on the smallest column."""

import json
from pathlib import Path

import pandas as pd

from cases import case
from compare.commands.claims import ROOT
from compare.study import atlas, boundary, frontier, headlines, point, recipe
from compare.study.distance import cost, errors

CI = ROOT / "cases" / "column_ci"


def cheapest_deposit() -> tuple[float, float]:
    """Error of the deposit from the mean of the grains, and how many times cheaper than one run of
    them here it is, of mu(I) on 4 mm cells.
    """
    scene = case.load(CI)
    grains = json.loads((CI / "reference" / "grains.json").read_text())
    run = point.run(CI, recipe.Recipe("dem", ()))
    made = point.measure(CI, recipe.Recipe("mpm", ("material.law=mu_i", "mpm.cell_size=0.004")))
    return (
        errors(made, grains["mean"], scene)["deposit"],
        cost(run) / cost(made),
    )


def deposit_error() -> float:
    return cheapest_deposit()[0]


def times_cheaper() -> float:
    return cheapest_deposit()[1]


def small_deposit_5() -> float:
    """Grains over the cheapest recipe whose deposit is within 5 %, in cost. [-]"""
    points, reference = frontier.committed("column_small")
    found = frontier.best(points, "deposit", 0.05)
    assert found is not None
    return frontier.grain_cost(reference) / float(found["cost"])


def on_the_cases_cells(name: str, law: str, card: str) -> pd.Series:
    """The point of a law and card on a case's own cells, nothing else changed."""
    points, _ = frontier.committed(name)
    found = frontier.on_cells(points, case.load(ROOT / "cases" / name)["mpm.cell_size"])
    return found[(found["law"] == law) & (found["card"] == card)].iloc[0]


def seed_column_cost() -> float:
    """Grains over the full model with dem_mu05, in cost. [-]"""
    point = on_the_cases_cells("column", "solid_fluid", "dem_mu05")
    return frontier.grain_cost(frontier.committed("column")[1]) / float(point["cost"])


def seed_column_answer() -> float:
    """Grains over the cheapest recipe of the full model with dem_mu05 within 1 %, in cost. [-]"""
    points, reference = frontier.committed("column")
    found = frontier.converged(points, "solid_fluid", "dem_mu05", 0.01)
    assert found is not None
    return frontier.grain_cost(reference) / float(found["cost"])


def seed_column_contact_share() -> float:
    """Error of the deposit of contact_share. [L0]"""
    return float(on_the_cases_cells("column", "contact_share", "contact_mu05")["error_deposit"])


def stable_fraction() -> float:
    """Largest stable mpm.time_step_fraction of the defaults on 4 mm cells, from below, to
    10 %. [-]
    """
    plane = recipe.study(case.load(CI), "atlas")["plane"][0] | {"values": [0.004]}
    ((_, task),) = atlas.rows_of(plane, 60.0)
    return boundary.bisect(boundary.runs_of(Path(CI), task), *plane["between"])[1]


def centre_of_mass_change() -> float:
    """Change of the deposit's centre of mass with a tenth of friction. [L0]"""
    return headlines.change(case.load(CI), 0.1, ("centre_of_mass_x",))["centre_of_mass_x"]
