"""What is told of softened grains and skeletons: by validator, finding and terminal."""

import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from cases import case
from compare.commands.run import stiffness
from compare.verdict.findings.softened import softened

COLUMN = Path(__file__).resolve().parents[2] / "cases" / "column"


def test_the_validator_tells_of_both_engines():
    soft = case.stiffness("cases/column", ["dem.young_modulus=3e5"])
    assert soft["mpm"]["weight_to_stiffness"] == pytest.approx(2e-3)
    assert 0 < soft["mpm"]["stiffness_factor"] < 1 and soft["mpm"]["softening_error"] > 0
    assert soft["dem"]["stiffness_factor"] == pytest.approx(0.01)  # (1/1000)^(2/3)
    hard = case.stiffness("cases/column", ["mpm.stiffness=as given"])
    assert all(one["stiffness_factor"] == 1 and not one["softening_error"] for one in hard.values())


@pytest.mark.parametrize(
    ("error", "told"), [(0.0, []), (0.02, []), (0.03, ["note"]), (0.06, ["caution"])]
)
def test_a_large_softening_is_found(error, told):
    attributes = {"softening_error": error, "weight_to_stiffness": 0.01}
    case_of = {"compare.margin_run_out": 0.05}
    pair = SimpleNamespace(
        mpm=[], dem=[SimpleNamespace(name="dem", attributes=attributes, case=case_of)]
    )
    assert [found.severity for found in softened(pair, {})] == told


def test_the_terminal_says_what_was_softened():
    def metrics(error):
        return {
            "weight_to_stiffness": {"mpm": 5e-3, "dem": 1e-3},
            "softening_error": {"mpm": error, "dem": None},
        }

    assert stiffness(metrics(0.0)) == []
    assert stiffness(metrics(0.0115))[0].endswith("continuum to 0.005 (1.1 %)")


def test_the_table_of_errors_is_what_was_measured():
    """Means over the displaced starts; of a law that collides, against one without the spring."""
    measured = pd.read_csv(COLUMN / "reference" / "softening.csv", comment="#")
    measured["run_out_95"] += 1.0
    figures = ["run_out_95", "centre", "height", "peak"]
    means = measured.groupby(["law", "asked"])[figures].mean()
    table = tomllib.loads((COLUMN.parent / "softening.toml").read_text())
    errors: dict[str, np.ndarray] = {}
    for law in measured["law"].unique():
        own = means.loc[law]
        given = own.loc["rigid" if "rigid" in own.index else "as given"]
        changes = [(own.loc[str(w)] / given - 1.0).abs().max() for w in table["weight"]]
        worst = np.array(changes)
        name = law.split(",")[0]
        errors[name] = np.maximum(errors.get(name, worst), worst)
    for name, found in errors.items():
        stated = table["error"][name]
        assert stated == pytest.approx(np.maximum.accumulate(found), abs=6e-5), name  # rounded
    assert set(table["error"]) - set(errors) == {"linear_elastic", "grains"}
