"""What a case's constants contradict of its grains is told before the run, kept with it and found.

The bounds themselves are tested in tests/cpp/case_constants_test.cpp.
"""

import types

import h5py
import numpy as np
import pytest

from cases import case
from cases.programs import ROOT, call, program
from compare.commands import calibrate
from compare.element import calibration
from compare.element.calibration import Fit, names
from compare.element.card import Card
from compare.mapping.reductions import example_run
from compare.verdict import findings
from compare.verdict.comparison import Comparison

SCENES = sorted(
    path.parent
    for path in (ROOT / "cases").glob("*/case.toml")
    if "\n[element]" not in path.read_text()
)
OTHER_GRAINS = "grains.friction=0.1"


@pytest.mark.parametrize("folder", SCENES, ids=lambda folder: folder.name)
def test_no_scene_of_ours_contradicts_its_grains(folder):
    assert case.load(folder).contradictions == ()
    assert len(case.load(folder, [OTHER_GRAINS]).contradictions) == 1


def test_a_run_tells_at_its_start_and_keeps_it(tmp_path, capsys):
    scene, words = ROOT / "cases" / "column_ci", ["--set", OTHER_GRAINS]
    words += ["--set", "time.maximum=0.01", "--quiet", "-o", tmp_path / "a.h5"]
    told = call([program("mpm_run"), scene, *words])
    assert told.returncode == 0
    first = f"warning: --set {OTHER_GRAINS}: grains.friction = 0.1 is not 0.5"
    assert told.stderr.startswith(first)
    case.tell_contradictions(case.load(scene, [OTHER_GRAINS]))
    assert capsys.readouterr().err == told.stderr.splitlines(keepends=True)[0]
    with h5py.File(tmp_path / "a.h5") as file:
        kept = file.attrs["contradictions"]
    kept = kept.decode() if isinstance(kept, bytes) else kept
    assert f"warning: {kept}" in told.stderr
    found = of_run("contradicted_constants", attributes={"contradictions": kept})
    assert len(found) == 1 and found[0].severity == "caution"
    assert "0.1 is not 0.5" in found[0].sentence
    assert found[0].advice.startswith("Calibrate a card for these grains")


def test_no_line_no_finding():
    for attributes in ({}, {"contradictions": "none"}):
        assert of_run("contradicted_constants", attributes=attributes) == []


def of_run(name: str, scene=None, attributes=None) -> list[findings.Finding]:
    """What a check finds of a continuum with the attributes, of the scene."""
    run = example_run(engine="mpm")
    run.case = scene or run.case
    run.attributes |= attributes or {}
    findings.all_checks()
    return findings.REGISTRY[name](Comparison([run], []), {})


def full(card: str, *overrides: str) -> case.Case:
    words = ["material.law=solid_fluid", f"material.card={card}", *overrides]
    return case.load(ROOT / "cases" / "column", words)


def test_the_seeds_correlation_length_contradicts_the_shear_test():
    found = of_run("shear_temperature", full("seed_table1"))
    assert len(found) == 1 and found[0].severity == "caution"
    assert found[0].figure == pytest.approx(0.607, abs=5e-3)
    assert "too fast" in found[0].sentence and "berzi × 1" in found[0].sentence
    slow = of_run("shear_temperature", full("dem_mu05", "material.correlation_factor=20"))
    assert len(slow) == 1 and "too slowly" in slow[0].sentence
    assert slow[0].figure and slow[0].figure > 1.5


@pytest.mark.parametrize(
    "scene",
    [
        ("dem_mu05",),
        ("seed_table1", "material.correlation_length=jenkins"),
        ("seed_table1", OTHER_GRAINS),  # of which the test has none
        ("seed_table1", "material.collisions=false"),
        ("seed_table1", "material.effective_restitution=1"),  # told by the other check
        ("seed_table1", "material.law=critical_state"),
    ],
    ids=" ".join,
)
def test_what_the_shear_test_does_not_contradict(scene):
    assert of_run("shear_temperature", full(*scene)) == []


def test_a_calibrated_card_says_its_grains_and_its_correlation_length(tmp_path):
    """The card can be used; it is silent of the grains it is of, and speaks of others."""
    blocks, grains = calibration.evidence(ROOT / "cases")
    options = types.SimpleNamespace(
        law="solid_fluid",
        start="seed_table1",
        card="mine",
        bootstrap=0,
        correlation="jenkins",
        grains="rolling",
    )
    start = calibrate.start_of(options, grains)
    assert start.correlation_length == "jenkins"
    assert start.effective_restitution == Card.read("seed_table1").effective_restitution
    error = dict.fromkeys(names(start), np.nan)
    text = calibrate.card_text(Fit(start, error, error, 1.0, 1, []), blocks, grains, options)
    assert "--correlation jenkins --grains rolling" in text
    (tmp_path / "mine.toml").write_text(text)
    own = full(str(tmp_path / "mine.toml"))
    assert own["material.correlation_length"] == "jenkins" and own.contradictions == ()
    assert len(full(str(tmp_path / "mine.toml"), OTHER_GRAINS).contradictions) == 1
