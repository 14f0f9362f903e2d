"""`grainpair test --only LAW`: what it calls, and what it makes of what they say."""

import argparse

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
