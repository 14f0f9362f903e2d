"""Arrows between folders point one way: what lies below never sees what is built on it."""

import ast
import re
from pathlib import Path

import pytest

from cases.programs import ROOT

# Whom a folder may see beside itself.
FOLDERS: dict[str, set[str]] = {
    "cases": set(),
    "mpm": {"cases"},
    "dem_reference": {"cases"},
    "compare": {"cases", "mpm", "dem_reference"},
    "tests": {"cases", "mpm", "dem_reference", "compare"},
}

# Layers of the continuum, from below: a file sees its own layer and those above it in this list.
LAYERS = [
    {"mpm/numbers"},
    {"mpm/grid"},
    {"mpm/transfer"},
    {"mpm/points"},
    {"mpm/materials"},
    {"mpm/external"},
    {"mpm/step"},
    {"mpm/output", "mpm/ranks"},
    {"mpm/programs", "mpm/bench"},
]


def layer(path: str) -> int:
    """Place in LAYERS of a file of mpm/."""
    folder = "/".join(path.split("/")[:2])
    return next(i for i, names in enumerate(LAYERS) if folder in names)


def python_arrows(path: str, text: str) -> list[tuple[int, str]]:
    """Line and path, such as cases/files, of every import, those inside functions and relative ones
    included.
    """
    package, out = path.split("/")[:-1], []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            out += [(node.lineno, alias.name.replace(".", "/")) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) + 1 - node.level] if node.level else []
            out.append((node.lineno, "/".join([*above, *(node.module or "").split(".")])))
    return out


def cpp_arrows(path: str, text: str) -> list[tuple[int, str]]:
    """Line and path of every #include "…"; one without a folder is of the file's own."""
    found = re.finditer(r'^[ \t]*#[ \t]*include[ \t]*"([^"]+)"', text, re.MULTILINE)
    return [
        (
            text.count("\n", 0, match.start()) + 1,
            match[1] if "/" in match[1] else str(Path(path).parent / match[1]),
        )
        for match in found
    ]


def upward(path: str, text: str) -> list[str]:
    """The lines of a file that see what they must not."""
    arrows = (python_arrows if path.endswith(".py") else cpp_arrows)(path, text)
    home, lines, out = path.split("/")[0], text.splitlines(), []
    for number, seen in arrows:
        folder = seen.split("/")[0]
        if folder not in FOLDERS:
            continue  # not of this clone
        strange = folder != home and folder not in FOLDERS[home]
        inner = home == folder == "mpm" and seen.count("/") > 1
        if strange or (inner and layer(seen) > layer(path)):
            out.append(f"{path}:{number}: {lines[number - 1].strip()}")
    return out


def sources() -> list[Path]:
    return [
        file
        for folder in FOLDERS
        for pattern in ("*.py", "*.hpp", "*.cpp", "*.in")
        for file in sorted((ROOT / folder).rglob(pattern))
        if pattern != "*.in" or file.name.endswith((".cpp.in", ".hpp.in"))
    ]


def test_no_import_and_no_include_points_upwards():
    files = sources()
    assert len(files) > 200  # all of them were looked at
    found = [
        line for file in files for line in upward(str(file.relative_to(ROOT)), file.read_text())
    ]
    assert not found, "\n" + "\n".join(found)


def test_every_folder_of_the_continuum_has_its_layer():
    folders = {str(file.parent.relative_to(ROOT)) for file in (ROOT / "mpm").rglob("*.[hc]pp")}
    assert folders == set().union(*LAYERS)


@pytest.mark.parametrize(
    "path, text, line",
    [
        ("cases/made_up.py", "import os\nfrom compare import study\n", 2),
        ("cases/made_up.py", "def f():\n    import mpm.x as y\n", 2),
        ("dem_reference/made_up.py", "from compare.report.charts import STYLE\n", 1),
        ("dem_reference/inner/made_up.py", "from ...mpm import x\n", 1),
        ("dem_reference/made_up.py", "from mpm import x\n", 1),
        ("cases/made_up.cpp", '#include <vector>\n#include "mpm/grid/grid.hpp"\n', 2),
        ("mpm/made_up.cpp", '  #  include "compare/mapping/cloud.hpp"\n', 1),
        ("mpm/grid/made_up.hpp", '\n#include "mpm/points/body.hpp"\n', 2),
        ("mpm/materials/made_up.hpp", '#include "mpm/step/solver.hpp"\n', 1),
    ],
)
def test_a_made_up_upward_arrow_is_caught(path, text, line):
    assert [found.split(": ")[0] for found in upward(path, text)] == [f"{path}:{line}"]


@pytest.mark.parametrize(
    "path, text",
    [
        (
            "compare/made_up.py",
            "from cases import files\nfrom dem_reference.grains import Grains\n",
        ),
        ("dem_reference/made_up.py", "from . import scene\nimport numpy\n"),
        ("mpm/step/made_up.hpp", '#include "ledger.hpp"\n#include "mpm/grid/grid.hpp"\n'),
        ("mpm/output/made_up.cpp", '#include "mpm/version.hpp"\n#include "cases/case.hpp"\n'),
    ],
)
def test_a_downward_arrow_is_none(path, text):
    assert not upward(path, text)
