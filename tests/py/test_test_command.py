"""`grainpair test --only LAW`: what it calls, and what it makes of what they say."""

import argparse
import shutil

import pytest

from compare.commands import test as command

PROGRAM = """#!/bin/sh
for word; do
  case $word in
    --gtest_filter=*) echo "$(basename $0) ${word#*=}" >> "$(dirname $0)/called" ;;
    --gtest_output=xml:*) printf '<testsuites><testsuite tests="3" failures="%s"/></testsuites>' \\
      "$FAILURES" > "${word#*xml:}" ;;
  esac
done
exit $FAILURES
"""


@pytest.fixture
def built(tmp_path, monkeypatch):
    """A build folder whose test programs only say what they were called with."""
    folder = tmp_path / "tests"
    folder.mkdir()
    for name in command.tests_of("mu_i"):
        (folder / name).write_text(PROGRAM)
        (folder / name).chmod(0o755)
    monkeypatch.setenv("GRAINPAIR_BUILD", str(tmp_path))
    monkeypatch.setattr(command, "pytest", lambda *_: 0)
    return folder


@pytest.mark.parametrize("failures", [0, 1])
def test_every_program_of_a_law_is_called_with_its_filter(built, monkeypatch, capfd, failures):
    monkeypatch.setenv("FAILURES", str(failures))
    code = command.run(argparse.Namespace(only="mu_i", slow=False))
    assert code == failures
    called = dict(line.split() for line in (built / "called").read_text().splitlines())
    assert called == command.tests_of("mu_i")
    count = 3 * len(called)
    said = f"C++ {count - failures * len(called)} passed, {failures * len(called)} failed"
    assert said in capfd.readouterr().out


def test_a_word_that_is_no_law_is_a_part_of_names():
    assert command.is_law("mu_i") and not command.is_law("solver") and not command.is_law("../x")


TESTS = """
from pathlib import Path
import pytest

@pytest.mark.parametrize("name", ["a b", "c[d]"])
def test_it_fails_the_first_time(name):
    seen = Path(__file__).with_name(f"seen {name}")
    assert seen.exists() or seen.write_text("")

@pytest.fixture
def broken():
    assert ALWAYS

def test_of_a_fixture(broken):
    pass
"""


@pytest.mark.parametrize("always", [True, False])
def test_what_failed_beside_others_is_tried_alone(tmp_path, monkeypatch, capfd, always):
    """Once: what fails then too is a failure, and so is what does not pass of many."""
    folder = tmp_path / "tests" / "py"
    folder.mkdir(parents=True)
    shutil.copy(command.ROOT / "tests" / "pytest.ini", tmp_path / "tests")
    (folder / "test_some.py").write_text(TESTS.replace("ALWAYS", str(always)))
    monkeypatch.setattr(command, "ROOT", tmp_path)
    options = argparse.Namespace(only="", slow=False)
    assert bool(command.pytest(options, tmp_path)) is not always
    told = capfd.readouterr().out
    place = "tests/py/test_some.py::test_"
    for name in ("a b", "c[d]"):
        assert f"{place}it_fails_the_first_time[{name}] failed, and alone not" in told
    assert (f"{place}of_a_fixture failed, and alone too" in told) is not always
    for seen in folder.glob("seen *"):
        seen.unlink()
    monkeypatch.setattr(command, "ALONE", 1)
    assert command.pytest(options, tmp_path) != 0
