"""Codes of failure: the same in both languages, and all that classes of failure hang on."""

import pickle
import re
import subprocess
import sys

import pytest

from cases.errors import CaseError, EngineError, Failure, Warned, code_of
from cases.programs import ROOT, program
from cases.stages import Stage, run_stages
from compare.study import failure, impact, point
from compare.study.recipe import Recipe
from dem_reference.process import stopped


def test_both_languages_have_the_same_codes():
    said = subprocess.run(
        [program("mpm_case"), "--failures"], capture_output=True, text=True, check=True
    ).stdout
    assert re.findall(r"^failure (\S+): .+$", said, re.M) == list(Failure)
    assert re.findall(r"^warning (\S+): .+$", said, re.M) == list(Warned)


def test_every_code_is_thrown_somewhere():
    """A code nobody gives would be a class that no run can show."""
    sources = "".join(
        path.read_text()
        for folder, pattern in (("mpm", "*.[ch]pp"), ("dem_reference", "*.py"))
        for path in (ROOT / folder).rglob(pattern)
    )
    for code in Failure:
        assert f"Failure::{code.name.lower()}" in sources or f"Failure.{code.name}" in sources, code
    for warning in Warned:
        assert f"Warning::{warning.name.lower()}" in sources, warning


@pytest.mark.parametrize("kind", [CaseError, EngineError])
def test_a_code_ends_the_line_and_is_read_from_it_again(kind):
    error = kind("LIGGGHTS: 3 grains are gone", Failure.LOST_GRAINS)
    assert str(error) == "LIGGGHTS: 3 grains are gone [lost-grains]"
    for again in (kind(str(error)), pickle.loads(pickle.dumps(error))):
        assert str(again) == str(error) and again.code is Failure.LOST_GRAINS
    assert kind("no code here [sic]").code is None and kind("lost-grains").code is None


@pytest.mark.parametrize("code, kind", [(2, CaseError), (3, EngineError)])
def test_a_childs_line_hands_its_code_on(code, kind):
    with pytest.raises(kind) as caught:
        run_stages(
            [Stage("s", ["sh", "-c", f"echo 'gone [ejected]' >&2; exit {code}"])], quiet=True
        )
    assert caught.value.code is Failure.EJECTED and str(caught.value) == "gone [ejected]"


CLASSES = {
    "not-finite": "not a number",
    "energy-growth": "energy growth",
    "ejected": "ejected points",
    "inverted": "inverted volume",
    "lost-grains": "lost grains",
    "refused": "refused",
    "cpu-limit": "timeout",
    "unattainable": "engine failure",
    "library": "engine failure",
}


def test_classes_of_stored_studies_hang_on_the_code_alone():
    assert set(CLASSES) == set(Failure)
    for code, name in CLASSES.items():
        assert failure.classify(code_of(f"whatever the message says [{code}]")) == name
        # the words of every other class, and no code: nothing is told from words
        assert failure.classify(code_of(f"{name}: not finite, lost, too fast, energy grew")) == (
            failure.OTHER
        )


@pytest.mark.parametrize("words", ["energy grew to 3 J", "reworded beyond recognition"])
def test_a_reworded_message_stays_in_its_class(monkeypatch, words):
    """A run of a study, whose engine is a script that fails in these words."""
    script = f"import sys; print('case: {words} [energy-growth]', file=sys.stderr); sys.exit(3)"
    monkeypatch.setattr(Recipe, "words", lambda *_: [sys.executable, "-c", script])
    found = point.measure(ROOT / "cases" / "column_ci", Recipe("mpm"))
    assert found["status"] == "energy growth"
    assert found["message"] == f"case: {words} [energy-growth]"


def test_a_run_beyond_its_processor_time_is_a_timeout(monkeypatch):
    for script in ("import os; os.kill(os.getpid(), 24)", "import sys; sys.exit('x [cpu-limit]')"):
        monkeypatch.setattr(Recipe, "words", lambda *_, s=script: [sys.executable, "-c", s])
        found = point.measure(ROOT / "cases" / "column_ci", Recipe("dem"))
        assert found["status"] == "timeout" and found["message"].startswith("stopped after")


def test_the_grains_engines_last_words_are_given_a_code_where_they_are_read():
    assert stopped(1, "ERROR: Lost atoms: original 9 current 8").code is Failure.LOST_GRAINS
    assert stopped(-24, "it said nothing").code is Failure.CPU_LIMIT
    assert stopped(1, "ERROR: Unknown command").code is None


def test_a_collision_that_fails_otherwise_is_no_lost_grain(monkeypatch):
    def fail(error):
        monkeypatch.setattr(impact, "collisions", lambda *_: (_ for _ in ()).throw(error))
        return impact.collide(ROOT / "cases" / "column_ci", (), 0.1, 1.0, 0.05)["status"]

    assert fail(EngineError("a pair still touches", Failure.LOST_GRAINS)) == "lost grains"
    assert fail(EngineError("LIGGGHTS: the library is missing")) == "engine failure"


def test_warnings_are_told_by_the_word_before_the_colon():
    lines = "loss: a third of it\nnoise: none of the drift: that you think"
    assert failure.warnings_of(lines) == {Warned.LOSS, Warned.NOISE}
    assert failure.warnings_of("none") == set()
