"""The grains that a study is held against are those of its case, whatever they are called."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from cases.case import load
from cases.errors import CaseError
from cases.programs import ROOT
from cases.scenes import is_chute
from compare.chute.signature import STEADY_FLOW
from compare.study import reference
from compare.study.measure import COLLAPSE

CI = ROOT / "cases" / "column_ci"
COMMITTED = sorted(ROOT.glob("cases/*/reference/grains.json"))


@pytest.mark.parametrize("path", COMMITTED, ids=lambda path: path.parts[-3])
def test_a_committed_reference_is_of_the_grains_of_its_case(path):
    scene = load(path.parents[1])
    by = STEADY_FLOW if is_chute(scene["geometry"]) else COLLAPSE
    assert len(reference.read(path, scene, by)["members"]) > 1


@pytest.mark.parametrize(
    "told, key",
    [
        ("grains.friction=0.05", "grains.friction = 0.5, not 0.05"),
        ("grains.restitution=0.5", "grains.restitution"),
        ("geometry.thickness=0.01", "geometry.thickness"),
        ("geometry.gravity=1.6", "geometry.gravity"),
        ("initial.void_ratio=0.8", "initial.void_ratio"),
        ('walls.front_back="smooth"', "walls.front_back"),
        ("dem.coarsening=2", "dem.coarsening"),
        ("time.maximum=3", "time.maximum"),
    ],
)
def test_grains_of_other_inputs_are_refused_in_a_line_that_tells_them(monkeypatch, told, key):
    """A mean that is kept, and runs; both agree with the case in height, length and diameter."""
    scene = load(CI, [told])
    with pytest.raises(CaseError) as of_mean:
        reference.read(CI / "reference" / "grains.json", scene)
    monkeypatch.setattr(reference, "open_run", lambda file: SimpleNamespace(case=load(CI)))
    with pytest.raises(CaseError) as of_runs:
        reference.of_runs([Path("1.h5"), Path("2.h5")], scene)
    for line in (str(of_mean.value), str(of_runs.value)):
        assert key in line and "\n" not in line
        assert "make them with: python3 -m dem_reference.ensemble" in line


@pytest.mark.parametrize(
    "told", ['title="other"', "material.stress_ratio=1.2", "mpm.cell_size=0.004"]
)
def test_what_decides_no_grains_refuses_none(told):
    reference.read(CI / "reference" / "grains.json", load(CI, [told]))


def test_a_reference_that_does_not_state_its_inputs_is_refused(tmp_path):
    found = json.loads((CI / "reference" / "grains.json").read_text())
    del found["made_of"]
    (tmp_path / "grains.json").write_text(json.dumps(found))
    with pytest.raises(CaseError, match="does not state what it was made of"):
        reference.read(tmp_path / "grains.json", load(CI))


def test_a_key_that_the_schema_gained_since_counts_with_its_default(tmp_path):
    found = json.loads((CI / "reference" / "grains.json").read_text())
    del found["made_of"]["dem.coarsening"]
    (tmp_path / "grains.json").write_text(json.dumps(found))
    reference.read(tmp_path / "grains.json", load(CI))
    with pytest.raises(CaseError, match="dem.coarsening = 1.0, not 2.0"):
        reference.read(tmp_path / "grains.json", load(CI, ["dem.coarsening=2"]))
