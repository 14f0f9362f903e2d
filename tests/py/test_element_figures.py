"""The element command's pieces on the shipped references.

Tables, verdicts, figures, the engines' cross-check.
"""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from cases.programs import ROOT
from compare import __main__ as cli
from compare.element import cross_check, records
from compare.element.blocks import every
from compare.element.case import Case
from compare.element.deviations import table, verdicts
from compare.element.card import Card
from compare.element.model import Law, Model
from compare.element.tests import compared_tests, shear


def reference(test):
    case = Case(ROOT / "cases" / test)
    return case, records.measured(case)


@pytest.mark.parametrize("test", compared_tests(), ids=lambda test: test.name)
def test_every_test_is_drawn_and_judged(test, tmp_path):
    case, rows = reference(test.name)
    models: dict[str, Law] = {
        name: Model(Card.read(name), case.grains) for name in ("seed_table1", "dem_mu05")
    }
    files = test.draw(rows, models, tmp_path / test.name)
    assert sorted(file.suffix for file in files) == [".png", ".svg"]
    assert all(file.stat().st_size > 10_000 for file in files)
    assert len(list(tmp_path.iterdir())) == 2  # nothing half-written beside them
    blocks = test.blocks(rows, every)
    errors = table(blocks, models)
    assert np.isfinite([row["error"] for row in errors]).all()
    assert len(verdicts(errors)) == 2 * len(blocks)


def test_a_verdict_tells_a_right_law_from_a_wrong_one():
    case, rows = reference("shear")
    model = Model(Card.read("seed_table1"), case.grains)
    blocks = [replace(block, measured=block.predict(model)) for block in shear.blocks(rows, every)]
    wrong = Model(model.card.with_values(effective_restitution=0.9), case.grains)
    right, refused = (
        [line for line in verdicts(table(blocks, {"card": law})) if "temperature" in line][0]
        for law in (model, wrong)
    )
    assert ": agrees (" in right and ": disagrees (" in refused


def test_the_two_engines_agree_on_what_is_local():
    """12 %: the core's solid fraction is known to 1 % and p/(rho T) rises by 12 % per 1 % there.

    s/p hardly depends on it.
    """
    _, walls = reference("bumpy_shear")
    case, homogeneous = reference("shear")
    assert walls
    for deviation in cross_check.deviations(walls, homogeneous, case.grains.density):
        assert abs(deviation["pressure over temperature"]) < 0.12
        assert abs(deviation["stress ratio"]) < 0.05


def test_the_command_measures_a_small_point_and_reports(tmp_path, capsys):
    assert (
        cli.main(
            [
                "element",
                str(ROOT / "cases" / "cooling"),
                "--quick",
                "--closed-form",
                "--out",
                str(tmp_path),
            ]
        )
        == 0
    )
    report = json.loads((tmp_path / "errors.json").read_text())
    assert report["errors"] and len(report["verdicts"]) == 2
    assert report["verdicts"][0] in capsys.readouterr().out


def test_bad_input_is_one_line(tmp_path, capsys):
    assert cli.main(["element", str(tmp_path / "nowhere")]) == 2
    assert cli.main(["element", str(ROOT / "cases" / "bumpy_shear")]) == 2
    assert cli.main(["element", str(ROOT / "cases" / "shear"), "--card", "sand"]) == 2
    assert capsys.readouterr().err.count("\n") == 3


def test_a_card_needs_every_test(tmp_path, capsys):
    for test in compared_tests():
        (tmp_path / test.name).mkdir()
        shutil.copy(ROOT / "cases" / test.name / "case.toml", tmp_path / test.name)
    assert cli.main(["calibrate", "--cases", str(tmp_path), "--out", str(tmp_path)]) == 2
    assert "no measured point" in capsys.readouterr().err
    assert not list(tmp_path.glob("*.toml"))
