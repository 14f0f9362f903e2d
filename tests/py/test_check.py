"""The checks of style and types: a mistake is noticed, what is listed is there."""

import argparse
import re
import sys

import pytest

from cases.programs import ROOT
from compare.commands import check


def asked(*tools: str) -> argparse.Namespace:
    return argparse.Namespace(tools=list(tools), fix=False)


def test_one_tool_that_finds_something_fails_the_whole(monkeypatch, capsys):
    monkeypatch.setattr(check, "CHECKS", {"good": lambda: "", "bad": lambda: "a.py:1: wrong"})
    assert check.run(asked()) == 1
    told = capsys.readouterr().out
    assert "a.py:1: wrong" in told and told.endswith("grainpair check: bad failed\n")
    assert check.run(asked("good")) == 0


def test_a_tool_that_is_none_is_bad_input(capsys):
    assert check.run(asked("nosuch")) == 2
    assert "no tool 'nosuch'" in capsys.readouterr().err


@pytest.mark.parametrize(
    "program, said",
    [("print('x'); exit(1)", "x"), ("exit(3)", "ended with 3"), ("print('x')", "")],
)
def test_what_a_tool_says_counts_where_it_fails(program, said):
    told = check.words([sys.executable, "-c", program])
    assert said in told and bool(said) == bool(told)


@pytest.mark.parametrize("launcher", ["", "/usr/bin/ccache", "cmake -E env KEY=1 /usr/bin/ccache"])
def test_flags_are_left_that_another_compiler_understands(launcher):
    command = (
        f"{launcher} /usr/bin/c++ -DNAME=1 -I/a -isystem /usr/include/b -O3 -Wall -Winvalid-pch"
        " -include /x/cmake_pch.hxx -std=c++20 -o out/a.o -c /src/a.cpp"
    )
    assert check.compiler(command) == [
        *("-DNAME=1", "-I/a", "-isystem", "/usr/include/b", "-O3", "-std=c++20")
    ]


def test_every_pattern_of_what_is_looked_at_finds_a_file():
    assert all(list(ROOT.glob(pattern)) for pattern in check.TIDY)
    assert all((ROOT / script).exists() for script in check.SCRIPTS)


def test_a_file_is_looked_at_again_when_a_header_changes(tmp_path, monkeypatch):
    monkeypatch.setattr(check, "ROOT", tmp_path)
    (tmp_path / ".clang-tidy").write_text("rules")
    (tmp_path / "a.cpp").write_text('#include "a.hpp"\n')
    (tmp_path / "a.hpp").write_text("int a;\n")
    before = check.digest("a.cpp", [])
    assert check.digest("a.cpp", []) == before
    assert check.digest("a.cpp", ["-O3"]) != before
    (tmp_path / "a.hpp").write_text("long a;\n")
    assert check.digest("a.cpp", []) != before


def test_every_tool_comes_from_the_list_that_the_launcher_installs():
    listed = (ROOT / "packages-check.txt").read_text().split("\n")
    assert set(check.CHECKS) <= set(listed)


def test_a_users_first_run_installs_no_linter():
    listed = re.sub("#.*", "", (ROOT / "packages.txt").read_text()).split()
    assert not set(check.CHECKS) & set(listed)
