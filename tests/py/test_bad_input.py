"""Bad case files: each gives one clear line and exit code 2, and leaves nothing behind."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cases.programs import ROOT, program

CARD = ROOT / "cases" / "materials" / "seed_table1.toml"
SEED = (
    (ROOT / "cases" / "column" / "case.toml")
    .read_text()
    .replace('card = "seed_table1"', f'card = "{CARD}"')
)


def but(old: str, new: str) -> bytes:
    """The seed's case with one thing changed."""
    assert old in SEED
    return SEED.replace(old, new).encode()


# What is wrong: the file (None: there is none), and the words the line must have.
BROKEN = {
    "missing key": (but("height = 0.1\n", ""), "missing key 'geometry.height'"),
    "wrong type": (
        but("friction = 0.5", 'friction = "rough"'),
        "case.toml:14: grains.friction must be a number",
    ),
    "negative diameter": (
        but("diameter = 0.002", "diameter = -0.002"),
        "case.toml:10: grains.diameter = -0.002 m is out",
    ),
    "unknown law": (but("lade_duncan", "lade_dunkan"), "Did you mean 'lade_duncan'?"),
    "empty file": (b"", "is empty"),
    "binary file": (b"\x89HDF\r\n\x1a\n\0\0\0\0", "binary data"),
    "not a number": (
        but("restitution = 0.879", "restitution = nan"),
        "grains.restitution = nan is not a finite number",
    ),
    "unit mistake": (
        but("diameter = 0.002", "diameter = 2.0"),
        "Is it in m? 1000 times less would fit.",
    ),
    "unreadable path": (None, "cannot be read"),
    "contradictory walls": (
        but('base = "glued"', 'base = "glued"\nbase_friction = 0.5'),
        "contradicts walls.base",
    ),
}


def call(command: list, folder: Path) -> subprocess.CompletedProcess:
    return subprocess.run(
        [str(word) for word in command],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )


# The other kinds of input file: the kind, the file, and the words the line must have.
BROKEN_OF_KIND = {
    "element test": (
        "element",
        '[element]\ntest = "sheer"\n',
        "input.toml:2: unknown element.test",
    ),
    "point path": ("point", 'case = "x"\n[start]\n[[legs]]\n', "input.toml:3: unknown key 'legs'"),
    "study": ("study", "[ladder]\ntimeout = 1.0\nrungs = 1\n", "input.toml:3: unknown key"),
    "not TOML": ("study", "[ladder\n", "input.toml:1: not valid TOML"),
    "nothing": ("point", "", "input.toml: is empty"),
}


@pytest.mark.parametrize("what", BROKEN_OF_KIND)
def test_broken_file_of_another_kind_gives_one_line_and_code_2(tmp_path, what):
    kind, content, words = BROKEN_OF_KIND[what]
    (tmp_path / "input.toml").write_text(content)
    result = call([program("mpm_case"), "input.toml", "--kind", kind], tmp_path)
    assert result.returncode == 2 and result.stdout == ""
    assert result.stderr.startswith(words) and result.stderr.count("\n") == 1


PROGRAMS: dict[str, list] = {
    "launcher": [sys.executable, "-m", "compare", "run", "case.toml"],
    "validator": [program("mpm_case"), "case.toml"],
    "continuum": [program("mpm_run"), "case.toml", "-o", "mpm.h5"],
    "grains": [sys.executable, "-m", "dem_reference.run", "case.toml", "-o", "dem.h5"],
}


@pytest.mark.parametrize("who", PROGRAMS)
@pytest.mark.parametrize("what", BROKEN)
def test_broken_case_gives_one_line_and_code_2(tmp_path, what, who):
    content, words = BROKEN[what]
    if content is not None:
        (tmp_path / "case.toml").write_bytes(content)
    before = set(tmp_path.rglob("*"))
    result = call(PROGRAMS[who], tmp_path)
    assert result.returncode == 2, result.stderr
    assert result.stderr.count("\n") == 1 and result.stderr.startswith("case.toml")
    assert words in result.stderr
    assert result.stdout == ""
    assert set(tmp_path.rglob("*")) == before


WHOLE = {
    "scene": SEED,
    "element": (ROOT / "cases" / "shear" / "case.toml").read_text(),
    "study": (ROOT / "cases" / "column_ci" / "study.toml").read_text(),
    "point": f"""case = "{ROOT / "cases" / "column"}"
set = ["material.law=mu_i"]
[start]
stress = [1e3, 2e3, 1e3, 0, 0, 0]
[[leg]]
path = "simple_shear"
constant = "stress"
rate = 1
strain = 0.1
steps = 10
""",
}


@settings(max_examples=400, deadline=None)
@given(st.data())
def test_no_damage_to_an_input_file_crashes_the_validator(tmp_path_factory, data):
    """A piece of a file is replaced by arbitrary bytes: accepted or refused in one line."""
    kind = data.draw(st.sampled_from(sorted(WHOLE)))
    text = WHOLE[kind].encode()
    start = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(start, min(start + 20, len(text))))
    file = tmp_path_factory.getbasetemp() / "damaged.toml"
    file.write_bytes(text[:start] + data.draw(st.binary(max_size=20)) + text[end:])
    command = [program("mpm_case"), file, "--kind", kind]
    result = subprocess.run(command, capture_output=True, timeout=60)
    assert result.returncode in (0, 2)
    assert result.stderr.count(b"\n") == (result.returncode == 2)
