"""What a command line of grainpair needs installed and built; prints nothing where that is nothing.

Else, line by line: the lists of packages; then, where something is to be built, the folder of the
sources, as CMake is told it; the build folder; a digest of the sources, which the launcher leaves
there for each target that it has built; `ready` where all that is needed is there and of these
sources, else `stale`; the parts of the build that ninja's targets belong to (GRAINPAIR_PARTS of
CMakeLists.txt); these targets. A command's file says what it needs, as `TARGETS = ["…"]` or as a
function `targets(words)`; where it says neither, it needs all the programs. By `PACKAGES = ["…"]`
it names the lists packages-….txt that it needs besides packages.txt, by `{"--option": ["…"]}` what
an option does. Help, the version and words that are no command need nothing.
Only Python's own library is imported: the launcher asks before anything is installed.
"""

import ast
import importlib
import os
import re
import sys
from contextlib import suppress
from pathlib import Path

from cases.content import of_files
from cases.errors import CaseError
from cases.files import replacing
from cases.programs import ROOT, can_write, of_this_clone, user_cache

COMMANDS = Path(__file__).parent / "commands"
HELP = {"-h", "--help", "--version"}
COMPILED = (".cpp", ".hpp", ".c", ".h", ".f90", ".in", ".txt", ".cmake")  # suffixes
PARTS = {"mpm_case": ["programs"]}  # targets that hold others
EVERY_PART = ["laws", "tests", "benchmarks"]


def command(words: list[str]) -> Path | None:
    """The file of the command that the command line `words` starts with."""
    asked = [word.replace("-", "_") for word in words[:1]]
    return next((one for one in COMMANDS.glob("[a-z]*.py") if [one.stem] == asked), None)


def targets(words: list[str]) -> list[str]:
    """Targets of the build that the command line `words` (without the launcher's name) needs."""
    file = command(words)
    if file is None or HELP & set(words):
        return []
    laws = ["laws"] if asks_example_law(words) else []
    for node in ast.parse(file.read_text()).body:
        match node:
            case ast.Assign(targets=[ast.Name("TARGETS")], value=value):
                named = list(ast.literal_eval(value))
                return [*named, *laws] if named == ["programs"] else named
            case ast.FunctionDef(name="targets"):
                return importlib.import_module(f"compare.commands.{file.stem}").targets(words[1:])
    return ["programs", *laws]


def packages(words: list[str]) -> list[str]:
    """Names of the lists of packages that the command line `words` needs, if any."""
    needed = targets(words)
    file = command(words)
    if file is None or HELP & set(words):
        return []
    more: list[str] = []
    options = {"--profile": ["cluster"], "--ranks": ["cluster"]}
    for node in ast.parse(file.read_text()).body:
        match node:
            case ast.Assign(targets=[ast.Name("PACKAGES")], value=ast.Dict() as value):
                options |= ast.literal_eval(value)
            case ast.Assign(targets=[ast.Name("PACKAGES")], value=value):
                more += ast.literal_eval(value)
    for option, names in options.items():
        more += names if is_given(option, words) else []
    more += ["laws"] if "laws" in needed else []
    return ["packages.txt", *(f"packages-{name}.txt" for name in more)] if needed or more else []


def is_given(option: str, words: list[str]) -> bool:
    """Whether it is among the words, maybe cut short."""
    return any(option.startswith(word.split("=")[0]) for word in words if len(word) > 4)


def asks_example_law(words: list[str]) -> bool:
    """Whether a word, or the text of a case that it names, means a law of cases/laws."""
    laws = ROOT / "cases" / "laws"
    names = "|".join(file.stem for file in laws.glob("*") if file.suffix in (".c", ".f90"))
    asked = re.compile(rf"(^|/)laws/|library\s*=\s*[\"']?(lib)?({names})\b")
    texts = list(words)
    for word in words:
        for file in (Path(word), Path(word) / "case.toml", ROOT / "cases" / word / "case.toml"):
            with suppress(OSError, ValueError):  # no name of a file, or no text
                texts += [file.read_text()] if file.suffix == ".toml" and file.is_file() else []
    return any(map(asked.search, texts))


def parts(needed: list[str]) -> list[str]:
    """The parts of the build, besides the programs, that the targets `needed` belong to."""
    if "all" in needed:
        return EVERY_PART
    tests = ["tests"] if any(target.endswith("_test") for target in needed) else []
    return [*(part for part in ("laws", "benchmarks") if part in needed), *tests]


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
    needed, lists = targets(words), packages(words)
    if not needed:
        return [" ".join(lists)] if lists else []
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
    asked = parts(needed)
    # CMake has the program for ranks built where it finds MPI, which the list may have brought now.
    if is_given("--ranks", words):
        state = state if (folder / "mpm_run_ranks").exists() else "stale"
        asked = [*asked, "ranks"]
    built = [str(source), str(folder), digest, state, ";".join(asked), *needed]
    return [" ".join(lists), *built]


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
