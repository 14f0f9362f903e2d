"""Element tests of a law in a shared library: a card that names it."""

import json

import pytest

from cases.programs import ROOT, program
from compare.__main__ import main

pytestmark = pytest.mark.skipif(
    not program("laws/libmohr_coulomb.so").exists(), reason="the example laws are not built"
)
CARD = ROOT / "cases" / "laws" / "mohr_coulomb" / "case.toml"


def errors(folder, *words) -> list[dict]:
    assert main(["element", *map(str, words), "--out", str(folder)]) == 0
    return json.loads((folder / "errors.json").read_text())["errors"]


def test_mohr_coulomb_meets_its_own_friction_in_triaxial_compression(tmp_path):
    """q/p = 6 sin(phi)/(3 - sin(phi)) = 0.9 at every pressure, dense or loose."""
    rows = errors(tmp_path / "out", ROOT / "cases" / "triaxial", "--card", CARD)
    ratios = [row["model"] for row in rows if row["quantity"] == "triaxial stress ratio"]
    assert len(ratios) == 4
    assert ratios == pytest.approx([0.9] * 4, rel=1e-8)  # the lateral stress is held to 1e-10
    assert {row["card"] for row in rows} == {"mohr_coulomb"}


def test_temperature_of_a_law_without_one_is_told_as_none(tmp_path):
    case = ROOT / "cases" / "reversal"
    rows = errors(tmp_path / "out", case, "--card", CARD)
    none = [row for row in rows if "temperature" in row["quantity"]]
    assert all(row["model"] is None for row in none)
    assert any(row["model"] is not None for row in rows)


def test_what_a_card_of_a_library_cannot_do_is_one_line(tmp_path, capsys):
    def said(*words) -> str:
        assert main(["element", *map(str, words), "--out", str(tmp_path / "out")]) == 2
        return capsys.readouterr().err.strip()

    shear = ROOT / "cases" / "shear"
    assert "no granular temperature" in said(ROOT / "cases" / "cooling", "--card", CARD)
    assert "--closed-form" in said(shear, "--card", CARD, "--closed-form")
    assert "no material card" in said(shear, "--card", tmp_path / "gone.toml")
    ours = ROOT / "cases" / "materials" / "dem_mu05.toml"
    assert "no card of a shared library" in said(shear, "--card", ours)
