"""What a command line of grainpair needs built, and where; prints nothing where it needs nothing.

Else, line by line: the folder of the sources, as CMake is told it; the build folder; a digest of
the sources, which the launcher leaves there for each target that it has built; `ready` where all
that is needed is there and of these sources, else `stale`; ninja's targets. A command's file says
what it needs, as `TARGETS = ["…"]` or as a function `targets(words)`; where it says neither, it
needs all the programs. Help, the version and words that are no command need nothing.
Only Python's own library is imported: the launcher asks before anything is installed.
"""

import ast
import importlib
import os
import re
import sys
from pathlib import Path

from cases.content import of_files
from cases.errors import CaseError
from cases.files import replacing
from cases.programs import ROOT, can_write, of_this_clone, user_cache

COMMANDS = Path(__file__).parent / "commands"
HELP = {"-h", "--help", "--version"}
COMPILED = (".cpp", ".hpp", ".in", ".txt", ".cmake")  # suffixes
PARTS = {"mpm_case": ["programs"]}  # targets that hold others


def targets(words: list[str]) -> list[str]:
    """Targets of the build that the command line `words` (without the launcher's name) needs."""
    file = next((one for one in COMMANDS.glob("[a-z]*.py") if [one.stem] == words[:1]), None)
    if file is None or HELP & set(words):
        return []
    for node in ast.parse(file.read_text()).body:
        match node:
            case ast.Assign(targets=[ast.Name("TARGETS")], value=value):
                return ast.literal_eval(value)
            case ast.FunctionDef(name="targets"):
                return importlib.import_module(f"compare.commands.{file.stem}").targets(words[1:])
    return ["programs"]


def sources(root: Path = ROOT) -> str:
    """Digest of all that CMake and the compiler read of this clone."""
    files = [root / name for name in ("CMakeLists.txt", "CMakePresets.json", "cases/rates.toml")]
    for folder in ("cases", "mpm", "dem_reference/ledger", "compare/mapping", "tests"):
        files += [file for file in (root / folder).rglob("*") if file.suffix in COMPILED]
        files += (root / folder).glob("*schema.toml")
    return of_files(sorted(file for file in files if file.is_file()), root)


def ready(folder: Path, needed: list[str], digest: str) -> bool:
    """Whether the targets `needed` have been built in `folder` from the sources of `digest`."""

    def built(target: str) -> bool:
        record = folder / "built" / target
        return os.access(record, os.R_OK) and record.read_text().strip() == digest

    return all(any(map(built, [target, *PARTS.get(target, []), "all"])) for target in needed)


def plan(words: list[str]) -> list[str]:
    """The lines to print. Raises CaseError where CMake could not build there."""
    needed = targets(words)
    if not needed:
        return []
    digest, source, named = sources(), ROOT, os.environ.get("GRAINPAIR_BUILD")
    folder = Path(named or ROOT / "build" / "release")
    # What somebody else has built in his own clone is used as long as it is of its sources.
    if not named and not (can_write(folder) and plain(folder) or ready(folder, needed, digest)):
        folder = of_this_clone(user_cache(make=True)) / "build" / "release"
    if not plain(source):
        source = linked(of_this_clone(user_cache(make=True)) / "source")
    if not plain(folder):
        raise CaseError(
            f"{folder}: cannot be built in (CMake takes no such path) name another in "
            "GRAINPAIR_BUILD"
        )
    state = "ready" if ready(folder, needed, digest) else "stale"
    return [str(source), str(folder), digest, state, *needed]


def plain(path: Path) -> bool:
    """Whether CMake takes a path: #, < and > it refuses, others mean something to it."""
    return bool(re.fullmatch(r"[\w ./+@,=:~^-]+", str(path)))


def linked(link: Path) -> Path:
    """`link`, which leads to this clone."""
    if not link.is_symlink() or link.readlink() != ROOT:
        link.parent.mkdir(parents=True, exist_ok=True)
        with replacing(link) as part:
            part.symlink_to(ROOT)
    return link


if __name__ == "__main__":
    try:
        print(*plan(sys.argv[1:]), sep="\n")
    except CaseError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
