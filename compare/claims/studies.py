"""What the studies state, measured on the smallest column."""

import json
from pathlib import Path

from cases import case
from compare.commands.claims import ROOT
from compare.study import atlas, boundary, headlines, point, recipe
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
