"""A run of the frontier is held against the fine solution of its own law with its own card."""

import json

import numpy as np
import pandas as pd

from cases import case
from cases.programs import ROOT
from compare.study import frontier
from compare.study.recipe import Recipe

CI = ROOT / "cases" / "column_ci"
GRAINS = json.loads((CI / "reference" / "grains.json").read_text())


def solution(card: str, scale: float) -> dict:
    """A point whose deposit is that of the grains, stretched along x."""
    recipe = Recipe("mpm", ("material.law=solid_fluid", f"material.card={card}"))
    stretched = {"x": list(scale * np.array(GRAINS["mean"]["x"]))}
    own = {"key": card, "recipe": recipe.as_json(), "status": "ok"}
    return GRAINS["mean"] | stretched | own


def test_cards_are_not_mixed():
    seeds, own = (solution(card, x) for card, x in (("seed_table1", 1.0), ("dem_mu05", 1.3)))
    rows = frontier.table([seeds, own], [seeds, own], GRAINS, case.load(CI))
    runs = rows[~rows["fine"]].set_index("card")
    assert runs["numerical_deposit"].tolist() == [0.0, 0.0]
    assert runs.loc["dem_mu05", "error_deposit"] > runs.loc["seed_table1", "error_deposit"] + 0.1
    lone = frontier.table([own], [seeds], GRAINS, case.load(CI))
    assert np.isnan(lone.get("numerical_deposit", np.full(2, np.nan))[0])


# The price of an answer: the cheapest recipe near enough to its own law's fine solution, in deposit
# and in run-out; the grains do not enter.
def test_an_answer_is_near_in_deposit_and_run_out():
    rows = pd.DataFrame(
        [
            ("near", "mu_i", False, 3.0, 0.009, 0.009),
            ("far along the base", "mu_i", False, 2.0, 0.009, 0.02),
            ("far elsewhere", "mu_i", False, 1.0, 0.02, 0.009),
            ("near, and dear", "mu_i", False, 4.0, 0.001, 0.001),
            ("another law's", "lade_duncan", False, 1.0, 0.0, 0.0),
            ("fine", "mu_i", True, 0.5, 0.0, 0.0),
            ("failed", "mu_i", False, np.nan, np.nan, np.nan),
        ],
        columns=["label", "law", "fine", "cost", "numerical_deposit", "numerical_run_out"],
    ).assign(card=np.nan)
    found = frontier.converged(rows, "mu_i", "", 0.01)
    assert found is not None and found["label"] == "near"
    assert frontier.converged(rows, "mu_i", "", 0.0001) is None
