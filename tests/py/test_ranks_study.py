"""Ranks of the continuum: what was measured, and the model of more of them."""

import pandas as pd
import pytest

from cases.programs import ROOT
from compare.study import ranks

SPACE = pd.read_csv(ROOT / "cases" / "column" / "reference" / "ranks.csv", comment="#")
FLOW = pd.read_csv(ROOT / "cases" / "column" / "reference" / "ranks_flow.csv", comment="#")


def test_two_ranks_were_measured_to_be_faster():
    """On a million points; and a column twice as long takes two as long as one alone takes one."""
    assert ranks.of(SPACE, "one", "points") >= 1e6
    assert ranks.faster(SPACE) >= 1.7
    twice = ranks.of(SPACE, "two, twice as long", "step_seconds")
    assert twice <= ranks.of(SPACE, "one", "step_seconds") / 0.8
    assert ranks.of(SPACE, "two, twice as long", "points") == 2 * ranks.of(SPACE, "one", "points")


def test_a_flowing_column_is_shared_evenly_only_if_it_is_dealt_out_anew():
    assert ranks.of(FLOW, "two", "imbalance") < 1.05  # beyond which they are dealt out anew
    assert ranks.of(FLOW, "two, never dealt out anew", "imbalance") > 1.05
    kept, anew = (
        ranks.of(FLOW, name, "step_seconds") for name in ("two, never dealt out anew", "two")
    )
    assert kept > anew


def test_the_model_is_that_of_the_page_and_near_what_was_measured():
    text = (ROOT / "docs" / "reference" / "cluster.md").read_text()
    assert ranks.page(SPACE) in text
    points = ranks.of(SPACE, "two", "points")
    alone, two = (sum(ranks.model(SPACE, points, n, ranks.Network()).values()) for n in (1, 2))
    assert alone / two == pytest.approx(ranks.faster(SPACE), rel=0.15)
    # the control: ten times the points take one rank ten times as long
    more = sum(ranks.model(SPACE, 10 * points, 1, ranks.Network()).values())
    assert more == pytest.approx(10 * alone)


def test_a_cube_is_cut_into_whole_columns_of_cells():
    """A billion points are 500 cells long: no more than 62 ranks of eight cells can share them."""
    for points, count in ranks.MODELLED:
        assert (points / ranks.PER_CELL) ** (1 / 3) / count >= ranks.LEAST * 0.999
    assert ranks.unevenness(1e9, 62) == pytest.approx(62 / 500, rel=1e-3)
    assert ranks.unevenness(1e9, 2) == 0.05
