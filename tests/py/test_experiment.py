"""Columns beside what is published: what is asked, how figures are judged, what the page holds."""

import json

import numpy as np
import pytest

from cases import case
from cases.programs import ROOT
from compare import __main__ as cli
from compare.study import deposit, experiment, published, recipe

SCENE = ROOT / "cases" / "cylinder"
STUDY = """
[experiment]
timeout = 100.0
aspect_ratios = [0.5, 0.7]
packings = 2
set."mpm.cell_size" = 0.0015
set."time.maximum" = 3.0
set."dem.young_modulus" = 2e6
"""


def test_laws_of_both_geometries_are_read_and_tell_their_source():
    for geometry in ("plane", "axisymmetric"):
        found = published.read(geometry)
        assert len(found) >= 2 and all(one.source for one in found)
        for one in found:
            pieces = one.laws.get("run_out", [])
            for left, right in zip(pieces, pieces[1:]):  # powers that meet, to what is quoted
                assert left.high == right.low
                assert left(left.high) == pytest.approx(float(right(left.high)), rel=0.75)


def test_what_is_published_of_an_aspect_ratio():
    lube, lajeunesse, moose = published.read("axisymmetric")
    assert lube.at("run_out", 1.0) == pytest.approx(1.24)
    assert lajeunesse.at("run_out", 1.0) == pytest.approx(2.0)
    assert moose.at("run_out", 2.0) == pytest.approx(2.42)
    assert moose.at("run_out", 1.5) is None and lube.at("run_out", 0.1) is None
    assert published.band([lube, lajeunesse, moose], "run_out", 1.0) == pytest.approx((1.24, 2.0))


def test_edge_of_a_deposit_of_known_depth():
    """A monolayer holds 0.605 d of solid; single grains ahead of the deposit do not count."""
    x = np.arange(0.5, 10.0)
    solid = np.array([2.0, 1.0, 0.6, 0.3, 0.063, 0.0, 0.0, 0.5, 0.0, 0.0])
    third = 0.3 * np.pi / 6.0 / (np.sqrt(3.0) / 2.0)
    expected = 3.5 + (0.3 - third) / (0.3 - 0.063)
    assert deposit.edge(x, solid, 1.0) == pytest.approx(expected)
    assert deposit.edge(x, 10.0 + solid, 1.0) == 9.5 and deposit.edge(x, 0.0 * solid, 1.0) == 0.0


def test_columns_of_a_case_keep_its_length():
    scene = case.load(SCENE)
    columns = experiment.plan(scene, recipe.study(scene, "experiment"))
    assert [one.place for one in columns] == [0.5, 1.0, 2.0]
    for one in columns:
        assert len(one.dem) == 3 and {r.seed for r in one.dem} == {1, 2, 3}
        assert float(str(one.mpm["geometry.height"])) == pytest.approx(one.place * 0.024)


def test_figures_are_judged_by_margin_scatter_and_numerics():
    scene = case.load(SCENE)
    column = experiment.plan(scene, {"aspect_ratios": [1.0], "packings": 3, "timeout": 1.0})[0]
    others = published.read("axisymmetric")

    def words(run_out: float, numerical: float) -> dict:
        mpm = {"run_out": run_out, "height": 0.5, "until": 6.0, "cpu_seconds_engine": 1.0}
        mpm |= {"run_out_numerical": numerical, "height_numerical": 0.0}
        dem = [
            {"run_out": r, "height": h, "cpu_seconds_engine": 4.0}
            for r, h in ((1.20, 0.49), (1.21, 0.5), (1.22, 0.51))
        ]
        found = experiment.table(scene, [column], [[mpm, *dem]], others)
        return dict(zip(found["figure"], found["verdict"]))

    assert words(1.21, 0.0) == {"run_out": "agree", "height": "agree"}
    assert words(1.21, 0.5)["run_out"] == "unresolved"  # the numerics decide
    assert words(2.0, 0.0)["run_out"] == "differ"


def test_the_study_runs_both_engines_and_draws_them(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("GRAINPAIR_RUNS", str(tmp_path / "runs"))
    scene = tmp_path / "scene"
    scene.mkdir()
    (scene / "case.toml").write_text(f'extends = "{SCENE}/case.toml"\n')
    (scene / "study.toml").write_text(STUDY)
    out = tmp_path / "out"
    assert cli.main(["experiment", str(scene), "--out", str(out), "--quiet"]) == 0
    page, table = (out / "experiment.html").read_text(), (out / "experiment.csv").read_text()
    assert "Lajeunesse" in page and "<svg" in page and "a = 0.7: run-out" in page
    rows = [line for line in table.splitlines() if line.startswith(("0.5,", "0.7,"))]
    assert len(rows) == 4 and "nan" not in table.lower().split("settings")[0]
    assert "verdict" in capsys.readouterr().out
    kept = [json.loads(path.read_text()) for path in (tmp_path / "runs").rglob("deposit-*.json")]
    assert len(kept) == 6 and all(np.isfinite(one["run_out"]) for one in kept)
