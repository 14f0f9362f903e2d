"""What refinement does to the collapse of each law: the study, and the table that is kept."""

from subprocess import CompletedProcess

import numpy as np
import pandas as pd
import pytest

from cases.case import load
from cases.programs import ROOT
from compare.study import point, refined, refinement

SMALL = ROOT / "cases" / "column_small"


@pytest.fixture(scope="module")
def kept() -> pd.DataFrame:
    return pd.read_csv(SMALL / "reference" / "refinement.csv", comment="#")


def means(table: pd.DataFrame, law: str) -> pd.DataFrame:
    return table[table["law"] == law].groupby("cells").mean(numeric_only=True)


def row(cells: int, seed: int, at: float) -> dict:
    deposit = (np.array([at, at + 1.0]), np.ones(2))
    return {"law": "mu_i", "cells": cells, "seed": seed, "deposit": deposit}


def test_deposits_are_as_far_apart_as_they_were_put():
    rows = [row(10, 1, 0.0), row(10, 2, 0.01), row(20, 1, 0.2), row(40, 1, 0.25)]
    found = pd.DataFrame(refinement.distances(rows))
    assert list(found["to_next"]) == pytest.approx([0.2, np.nan, 0.05, np.nan], nan_ok=True)
    assert list(found["to_finest"]) == pytest.approx([0.25, np.nan, 0.05, np.nan], nan_ok=True)
    assert list(found["apart"]) == pytest.approx([0.01, 0.01, np.nan, np.nan], nan_ok=True)


def test_a_run_that_fails_is_a_row_without_figures(monkeypatch):
    def fail(words, **_):
        return CompletedProcess(words, 3, "", "cases/column_small: point 3: too fast [ejected]")

    monkeypatch.setattr(point, "call", fail)
    lost = refinement.one(SMALL, "mu_i", 40, 1)
    assert lost["status"] == "ejected points"
    found = pd.DataFrame(refinement.distances([row(10, 1, 0.0), row(20, 1, 0.2), lost]))
    assert list(found["to_next"]) == pytest.approx([0.2, np.nan, np.nan], nan_ok=True)
    assert found["to_finest"].isna().all()


def test_the_page_tells_runs_that_failed(tmp_path, monkeypatch):
    laws = {law: law.upper() for law in refinement.LAWS}
    table = (SMALL / "reference" / "refinement.csv").read_text()
    monkeypatch.setattr(refined, "origin", str)  # of the project's own files it tells the commit
    failing = tmp_path / "refinement.csv"
    failing.write_text(table.replace("lade_duncan,80,1,ok", "lade_duncan,80,1,ejected points"))
    assert refined.values(tmp_path, laws)["failed"] == (
        "LADE_DUNCAN on 80 cells, start 1: ejected points"
    )
    failing.write_text(table)
    assert refined.values(tmp_path, laws)["failed"] == ""


@pytest.mark.parametrize("last, comes", [(0.005, True), (0.02, False)])
def test_a_limit_is_where_refinement_moves_less_and_less(last, comes):
    rows = [row(10, 1, 0.0), row(20, 1, 0.01), row(40, 1, 0.01 + last)]
    assert refinement.limits(pd.DataFrame(refinement.distances(rows))) == {"mu_i": comes}


def test_laws_that_know_a_rate_come_to_a_limit_and_no_others_do(kept):
    """What has a limit moves further by refinement than by chance, on any cells. What has none is
    moved by chance on the finest cells, by more than a tenth of a comparison's margin.
    """
    comes, margin = refinement.limits(kept), load(SMALL)["compare.margin_distance"]
    assert {law for law, limit in comes.items() if limit} == {
        "mu_i",
        "solid_fluid",
        "contact_share",
    }
    for law, limit in comes.items():
        found = means(kept, law)
        if limit:
            assert (found["to_next"].dropna() > 3.0 * found["apart"].iloc[:-1]).all(), law
        assert (found["apart"].iloc[-1] > 0.1 * margin) != limit, law


@pytest.mark.parametrize("law", ["solid_fluid", "contact_share"])
def test_temperature_comes_with_the_cells_below_one_grain_and_not_above(kept, law):
    """From 10 cells to the finest: all of it by more than half, above a grain by less than 8 %."""
    found = means(kept, law)
    coarse, fine = found.iloc[0], found.iloc[-1]
    assert fine["fluctuation"] > 1.5 * coarse["fluctuation"]
    assert coarse["fluctuation_above"] == pytest.approx(fine["fluctuation_above"], rel=0.08)


@pytest.mark.parametrize("law", ["mu_i", "solid_fluid"])
def test_a_small_member_is_what_the_table_says(kept, law):
    """To three times what a displaced start does, and a thousandth for another machine's sums."""
    starts = kept[(kept["law"] == law) & (kept["cells"] == 10)]
    found = refinement.one(SMALL, law, 10, 1)
    for name in ("run_out_95", "centre", "height", "peak", "fluctuation", "fluctuation_above"):
        mean, apart = starts[name].mean(), np.ptp(starts[name])
        assert found[name] == pytest.approx(mean, abs=3.0 * apart, rel=1e-3), name
