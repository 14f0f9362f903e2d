"""Similar columns of grains, 2, 20 and 200 mm high, have one answer: what tells them apart is less
than what packings scatter by. The continuum's are in tests/cpp/similarity_test.cpp and in the table
[convergence] of cases/column_small/study.toml.
"""

from itertools import combinations

import pandas as pd
import pytest

from cases.programs import ROOT
from compare.verdict.equivalence import confidence_half_width

REFERENCE = ROOT / "cases" / "column_ci" / "reference"
SIZES = ("2mm", "20mm", "200mm")
FIGURES = ("run_out_99", "highest_grain_at_wall", "kinetic_energy_peak", "coordination")


def table(name: str) -> pd.DataFrame:
    return pd.read_csv(REFERENCE / f"{name}.csv", comment="#")


def apart(a: pd.DataFrame, b: pd.DataFrame, figure: str) -> bool:
    """Whether two ensembles differ at 1 %."""
    half = confidence_half_width(a[figure], b[figure], confidence=0.99)
    return abs(a[figure].mean() - b[figure].mean()) > half


@pytest.mark.parametrize("figure", FIGURES)
def test_columns_of_grains_differ_by_nothing_but_their_size(figure):
    for one, other in combinations(SIZES, 2):
        assert not apart(table(f"similar_{one}"), table(f"similar_{other}"), figure), (one, other)


def test_columns_that_are_not_similar_are_told_apart():
    stiff, small = table("softening_3e8"), table("similar_2mm")
    assert any(apart(stiff, small, figure) for figure in FIGURES)
