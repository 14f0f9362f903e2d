"""Keys of what is kept: a result is found again by what decides it, never by a name.

A key is a digest of the inputs declared for a result and of the sources that make it. So a commit
of text keeps every result, and a changed source loses those that it decides. Sources are told by
their place in the clone and their bytes.

    python3 -m cases.content FILE    # the digest of the continuum's sources; the build calls it
"""

import ast
import hashlib
import json
import sys
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from cases.files import write_atomically
from cases.programs import ROOT, program

# What mpm_run is built from, beside all of mpm/ but its benchmarks: patterns below the root.
CONTINUUM = (
    "CMakeLists.txt",
    "CMakePresets.json",
    "cmake/**/*",
    "cases/CMakeLists.txt",
    "cases/*.cpp",
    "cases/*.hpp",
    "cases/*.in",
    "cases/*schema*.toml",
    "mpm/**/*",
)
NO_SOURCES = (".md", ".bib")  # files of text only


def digest(value) -> str:
    """Of tables, lists, numbers and words, in 16 hexadecimal digits; the order of a table's keys
    does not count.
    """
    text = json.dumps(value, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def of_files(files: Iterable[Path], root: Path = ROOT) -> str:
    """Digest of files below `root`: their places and their bytes."""
    return digest(
        {
            str(file.relative_to(root)): hashlib.sha256(file.read_bytes()).hexdigest()
            for file in files
        }
    )


@cache
def imported(*entries: str, root: Path = ROOT) -> frozenset[Path]:
    """Files of the modules `entries` and of all that they import from this clone, imports inside
    functions included.

    A module that is imported by a name put together at run time is not seen: name it as an entry.
    """
    found: set[Path] = set()
    waiting = list(entries)
    while waiting:
        for file in files_of(waiting.pop(), root):
            if file not in found:
                found.add(file)
                waiting += names_in(file, root)
    return frozenset(found)


def files_of(module: str, root: Path) -> list[Path]:
    """The files that importing `module` runs: its own and those of the packages around it; none
    outside the clone.
    """
    words = module.split(".")
    packages = [root.joinpath(*words[: i + 1], "__init__.py") for i in range(len(words))]
    return [
        file for file in [*packages, root.joinpath(*words).with_suffix(".py")] if file.is_file()
    ]


@cache
def names_in(file: Path, root: Path) -> list[str]:
    """Modules that a file's import statements may mean; of `from a import b` both a and a.b."""
    package = file.relative_to(root).parts[:-1]
    names: list[str] = []
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) + 1 - node.level] if node.level else ()
            base = ".".join([*above, *([node.module] if node.module else [])])
            names += [base, *(f"{base}.{alias.name}" for alias in node.names)]
    return names


def continuum(root: Path = ROOT) -> list[Path]:
    """The sources that mpm_run is built from."""
    return sorted(
        {
            file
            for pattern in CONTINUUM
            for file in root.glob(pattern)
            if file.is_file()
            and file.suffix not in NO_SOURCES
            and not file.is_relative_to(root / "mpm" / "bench")
        }
    )


def of_continuum(root: Path = ROOT) -> str:
    """Digest of the sources of mpm_run: those it was built from, which the build records beside it,
    else those there are.

    The record keeps a program that is older than a source from filling the place of the one that is
    not built yet.
    """
    record = program("mpm_run").with_name("mpm_run.sources")
    if root == ROOT and record.exists():
        return record.read_text().strip()
    return of_files(continuum(root), root)


if __name__ == "__main__":
    write_atomically(Path(sys.argv[1]), of_files(continuum()) + "\n")
