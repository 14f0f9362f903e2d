"""Bad case files: each gives one clear line and exit code 2, and leaves nothing behind."""

import os
import subprocess
import sys
from argparse import ArgumentTypeError
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cases import command_line
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


DEEP = {
    "table": "[" + "a." * 60_000 + "a]\n",
    "key": "a" + ".a" * 60_000 + " = 1\n",
    "list": "title = " + "[" * 60_000 + "\n",
    "inline tables": "title = " + "{a = " * 60_000 + "\n",
    "quoted keys": '["' + '"."'.join("a" * 60_000) + '"]\n',
}


@pytest.mark.parametrize("kind", ["scene", "study"])
@pytest.mark.parametrize("what", DEEP)
def test_a_file_nested_without_end_is_refused(tmp_path, what, kind):
    (tmp_path / "deep.toml").write_text("# a line\n" + DEEP[what])
    result = call([program("mpm_case"), "deep.toml", "--kind", kind], tmp_path)
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == (
        "deep.toml:2: tables or lists lie more than 32 deep in each other (no key is that deep)\n"
    )


def test_text_that_only_looks_nested_is_taken(tmp_path):
    title = 'title = """a \\"[[[' + "[.{" * 100 + '"""  # ' + "[." * 100 + "\n"
    rest = SEED[SEED.index("\n", SEED.index("title")) :]
    (tmp_path / "case.toml").write_text(title + rest)
    result = call([program("mpm_case"), "case.toml"], tmp_path)
    assert (result.returncode, result.stderr) == (0, "")
    given = "title=" + "[" * 60_000
    assert call([program("mpm_case"), "case.toml", "--set", given], tmp_path).returncode == 0


ODD_PLACES = {
    "loop": "Too many levels of symbolic links",
    "n" * 300: "File name too long",
    "pipe": "is not a case file (a pipe, socket or device)",
    "/dev/zero": "is not a case file (a pipe, socket or device)",
    "folder": "folder/case.toml: cannot be read (No such file or directory)",
    "huge": "longer than 1 MiB",
}


@pytest.mark.parametrize("who", ["launcher", "validator", "grains", "extends"])
@pytest.mark.parametrize("place", ODD_PLACES)
def test_a_case_that_is_no_file_is_refused_with_the_reason(tmp_path, place, who):
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "huge").write_text("#" * 2**21)
    if who == "extends":
        (tmp_path / "case.toml").write_text(f'extends = "{place}"\n')
        command = [program("mpm_case"), "case.toml"]
    else:
        named = f"./{place}" if place[0] == "n" else place  # or it would be a case's name
        command = [named if word == "case.toml" else word for word in PROGRAMS[who]]
    result = call(command, tmp_path)
    assert result.returncode == 2, result.stderr
    words = "Is a directory" if (place, who) == ("folder", "extends") else ODD_PLACES[place]
    assert words in result.stderr and result.stderr.count("\n") == 1


@pytest.mark.parametrize("word", ["1.5", "1e3", "", " 5", "+5", "1_0", "٣", "9" * 5000])
def test_a_whole_number_is_written_in_digits(word):
    with pytest.raises(ArgumentTypeError):
        command_line.threads(word)


# Options that count, of every program that takes them.
COUNTS = {
    "--threads": (1024, [["launcher"], ["continuum"], ["mapping"], ["collapse"]]),
    "--seed": (2**32 - 1, [["launcher"], ["continuum"], ["grains"]]),
    "--ranks": (1024, [["launcher"], ["grains"], ["ensemble"]]),
    "--jobs": (1024, [["frontier"], ["ensemble"]]),
    "--cores": (1024, [["element"]]),
    "--seeds": (10_000, [["launcher"], ["frontier"], ["ensemble"]]),
}
COUNTED = [(one, *who) for one, (_, all_) in COUNTS.items() for who in all_]


@pytest.mark.parametrize("option, who", COUNTED)
def test_counts_have_the_same_bounds_in_every_program(tmp_path, option, who):
    """One beyond either end is refused; the ends are not, so that what is missing is told next."""
    most, least = COUNTS[option][0], 0 if option == "--seed" else 1
    for value in (least - 1, most + 1):
        result = call([*PROGRAMS[who], f"{option}={value}"], tmp_path)
        assert result.returncode == 2, (value, result.stderr)
        words = f"{option}: {value} is no whole number from {least} to {most}"
        assert words in result.stderr and result.stderr.count("\n") == 1, result.stderr
    for value in (least, most):
        result = call([*PROGRAMS[who], f"{option}={value}"], tmp_path)
        assert result.returncode == 2 and "whole number" not in result.stderr, result.stderr


PROGRAMS: dict[str, list] = {
    "launcher": [sys.executable, "-m", "compare", "run", "case.toml"],
    "validator": [program("mpm_case"), "case.toml"],
    "continuum": [program("mpm_run"), "case.toml", "-o", "mpm.h5"],
    "grains": [sys.executable, "-m", "dem_reference.run", "case.toml", "-o", "dem.h5"],
    "mapping": [program("grain_map"), "run.h5", "-o", "fields.h5"],
    **{
        name: [sys.executable, "-m", "compare", name, "case.toml"]
        for name in ("collapse", "frontier", "element")
    },
    "ensemble": [sys.executable, "-m", "dem_reference.ensemble", "case.toml"],
}
READ = ("launcher", "validator", "continuum", "grains")


@pytest.mark.parametrize("who", READ)
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
