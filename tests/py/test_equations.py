"""mpm/EQUATIONS.md and mpm/references.bib keep up with the code."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TABLE = (ROOT / "mpm" / "EQUATIONS.md").read_text()
SOURCES = [
    file for pattern in ("mpm/**/*.hpp", "mpm/**/*.cpp") for file in sorted(ROOT.glob(pattern))
]


def cited(pattern: str) -> set[str]:
    """What `pattern` finds in the sources of mpm/."""
    return {match for file in SOURCES for match in re.findall(pattern, file.read_text())}


def test_every_equation_cited_in_code_is_in_the_table():
    equations = cited(r"\[Ceccato2019, Eq\. (\d+)\]")
    assert equations  # the pattern still finds something
    assert equations <= set(re.findall(r"\[Ceccato2019, Eq\. (\d+)\]", TABLE))


def test_the_table_holds_all_of_the_seed():
    assert {int(n) for n in re.findall(r"\[Ceccato2019, Eq\. (\d+)\]", TABLE)} == set(range(1, 19))


def test_every_cited_work_has_an_entry():
    keys = cited(r"[\[;] ?([A-Z][A-Za-z]+(?:19|20)\d\d)\b")
    entries = set(re.findall(r"@\w+\{(\w+),", (ROOT / "mpm" / "references.bib").read_text()))
    assert keys
    assert keys <= entries, keys - entries


def test_every_test_the_table_names_exists():
    named = re.findall(r"`([A-Z]\w+)\.(\w+|\*)`", TABLE)
    tests = "\n".join(file.read_text() for file in (ROOT / "tests" / "cpp").glob("*_test.cpp"))
    for suite, name in named:
        wanted = r"\w+" if name == "*" else name
        assert re.search(rf"TEST(_F|_P)?\({suite},\s*{wanted}\)", tests), f"{suite}.{name}"
