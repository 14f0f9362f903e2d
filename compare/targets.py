"""What a command line of grainpair needs built, and where; prints nothing where it needs nothing.

Else, line by line: the build folder; a digest of the sources, which the launcher leaves there for
each target that it has built; `ready` where all that is needed is there and of these sources, else
`stale`; ninja's targets. A command's file says what it needs, as `TARGETS = ["…"]` or as a function
`targets(words)`; where it says neither, it needs all the programs. Help, the version and words that
are no command need nothing.
Only Python's own library is imported: the launcher asks before anything is installed.
"""

import ast
import importlib
import os
import sys
from pathlib import Path

from cases.content import of_files
from cases.errors import CaseError
from cases.programs import ROOT, can_write, own

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
    files = [root / "CMakeLists.txt", root / "CMakePresets.json"]
    for folder in ("cases", "mpm", "compare/mapping", "tests"):
        files += [file for file in (root / folder).rglob("*") if file.suffix in COMPILED]
        files += (root / folder).glob("*schema.toml")
    return of_files(sorted(file for file in files if file.is_file()), root)


def ready(folder: Path, needed: list[str], digest: str) -> bool:
    """Whether the targets `needed` have been built in `folder` from the sources of `digest`."""

    def built(target: str) -> bool:
        record = folder / "built" / target
        return record.is_file() and record.read_text().strip() == digest

    return all(any(map(built, [target, *PARTS.get(target, []), "all"])) for target in needed)


def plan(words: list[str]) -> list[str]:
    """The lines to print."""
    needed = targets(words)
    if not needed:
        return []
    digest, folder = sources(), Path(os.environ.get("GRAINPAIR_BUILD", ""))
    if not os.environ.get("GRAINPAIR_BUILD"):
        folder = ROOT / "build" / "release"
        # What somebody else has built in his own clone is used as long as it is of its sources.
        if not can_write(folder) and not ready(folder, needed, digest):
            folder = own("build", "release")
    return [str(folder), digest, "ready" if ready(folder, needed, digest) else "stale", *needed]


if __name__ == "__main__":
    try:
        print(*plan(sys.argv[1:]), sep="\n")
    except CaseError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
