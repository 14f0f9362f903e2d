"""MESSAGES.md holds every line that the sources can say, and none that they cannot."""

from pathlib import Path

import pytest

from cases.programs import ROOT
from tests import messages


def test_the_page_is_that_of_the_sources():
    known = messages.entries()
    assert messages.sorted_in(known, messages.lines()) == []
    assert messages.PAGE.read_text() == messages.page(known), "python3 -m tests.messages"


def test_many_lines_are_found():
    """What takes messages apart still does so: of both languages, whole and with their holes."""
    found = messages.lines()
    for line, file in {
        "…: in use by … wait for it, or choose another place": "cases/draft.cpp",
        "…: row … is … (not a finite number)": "cases/reading.py",
        "point …: volume inverted (void ratio …) at (…, …) m, t = … s lower "
        "mpm.time_step_fraction": "mpm/step/solver_points.cpp",
        "compiled for another machine": "mpm/external/shared_library.cpp",
    }.items():
        assert found[line] == file
    assert len(found) > 400


@pytest.mark.parametrize(
    "text, told, lines",
    [
        ('raise CaseError(f"{a}: b {c} d")', messages.python_lines, ["…: b … d"]),
        ('raise CaseError("x" if y else "z" + w)', messages.python_lines, ["x", "z…"]),
        ('refuse(where, "a {}"\n  "b", f(1, 2));', messages.cpp_lines, ["a …b"]),
        ('throw Error(where(x) + ": no, " + y);', messages.cpp_lines, ["…: no, …"]),
    ],
)
def test_lines_of_a_source(text, told, lines):
    assert list(told(text)) == lines


def test_what_is_wrong_is_told():
    """A line without an entry, and an entry without a line."""
    known = messages.entries()
    found = messages.lines() | {"a line of which nobody thought": "cases/new.cpp"}
    lost = next(line for line, file in found.items() if "in use by" in line)
    del found[lost]
    faults = messages.sorted_in(known, found)
    assert len(faults) == 2
    assert "cases/new.cpp" in faults[0] and "Another process works there" in faults[1]


def test_the_readme_leads_there():
    assert "(MESSAGES.md)" in (Path(ROOT) / "README.md").read_text()
