"""What is told of softened grains and skeletons: by validator, finding and terminal."""

from types import SimpleNamespace

import pytest

from cases import case
from compare.commands.run import stiffness
from compare.verdict.findings.softened import softened


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
