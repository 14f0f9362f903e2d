"""Programs and how they are started, and the folders that this install writes."""

import hashlib
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from cases import children
from cases.errors import CaseError, EngineError

ROOT = Path(__file__).resolve().parents[1]
PYTHON = "/usr/bin/python3"  # Debian's own: another one first on PATH would lack the packages
OURS = ("cases", "dem_reference", "compare")  # folders of modules
MARKS = "/._+,@=-"  # that mean nothing to any shell
PACKAGES = {"lmp": "lammps", "mpirun": "openmpi-bin"}  # of programs that are called otherwise


def module(name: str, *words, parent: int | None = None) -> list[str]:
    """The command line of a module of this clone, or of Debian's Python, with nothing of the
    caller's surroundings in it (cases/start.py). It dies with the process `parent`, where that
    is told, which must be the one that starts it.
    """
    start = ROOT / "cases" / "start.py"
    bound = ["--parent", str(parent)] if parent else []
    return [PYTHON, "-I", "-X", "utf8", str(start), *bound, name, *map(str, words)]


def alone() -> None:
    """Begins anew as `module` does where somebody typed python3 -m and a module of ours."""
    if sys.argv[:1] != ["-m"] or sys.flags.isolated or not os.access(PYTHON, os.X_OK):
        return
    name = sys.orig_argv[-len(sys.argv)].removeprefix("-m")
    if name.partition(".")[0] not in OURS:  # a user's own module, which imports grainpair
        return
    os.execv(PYTHON, module(name, *sys.argv[1:]))


def call(command: list, *, timeout: float | None = None, **options) -> subprocess.CompletedProcess:
    """Runs a program to its end and takes what it says as text; `options` are those of
    cases.children.start. It ends with us. Raises EngineError where it does not start, and
    subprocess.TimeoutExpired, with what it has said, where it goes on after `timeout` seconds.
    """
    taken: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    taken |= {"text": True, "errors": "replace"} | options
    try:
        process = children.start(command, **taken)
    except OSError as error:
        raise unstarted(str(command[0]), error) from error
    with process:
        try:
            out, err = process.communicate(timeout=timeout)
        except BaseException:
            children.end(process, group=options.get("start_new_session", False))
            raise
    return subprocess.CompletedProcess(process.args, process.returncode, out, err)


def unstarted(name: str | Path, error: OSError) -> EngineError:
    """Why a program did not start, in one line."""
    if not isinstance(error, FileNotFoundError):
        return EngineError(f"{name}: cannot be started ({error.strerror})")
    if os.sep in str(name):
        return EngineError(f"{name}: no such program (not built) any ./grainpair run builds it")
    package = PACKAGES.get(str(name), name)
    return EngineError(f"{name}: no such program (not installed) install the package {package}")


def program(name: str) -> Path:
    """Path of a compiled program: in $GRAINPAIR_BUILD, or where ./grainpair builds."""
    if named := os.environ.get("GRAINPAIR_BUILD"):
        return Path(named) / name
    elsewhere = of_this_clone(user_cache()) / "build" / "release" / name
    return elsewhere if elsewhere.exists() else ROOT / "build" / "release" / name


def kept(*words: str) -> Path:
    """A folder of results that are kept for other runs: in $GRAINPAIR_RUNS, or in runs of this
    install.
    """
    named = os.environ.get("GRAINPAIR_RUNS")
    return (Path(named).resolve() if named else own("runs")).joinpath(*words)


def own(*words: str) -> Path:
    """A folder that this install writes: of the clone, or of the user's cache where the clone
    belongs to somebody else.
    """
    inside = ROOT.joinpath(*words)
    return inside if can_write(inside) else of_this_clone(user_cache(make=True)).joinpath(*words)


def of_this_clone(cache: Path) -> Path:
    """Its folder of a cache; another clone has another."""
    return cache / "grainpair" / hashlib.sha256(os.fsencode(ROOT)).hexdigest()[:16]


def can_write(path: Path) -> bool:
    """Whether a file or folder is there to be written, or can be made."""
    there = path
    while not os.path.lexists(there):
        there = there.parent
    return os.access(there, os.W_OK | os.X_OK if there.is_dir() else os.W_OK)


def user_cache(*, make: bool = False) -> Path:
    """$XDG_CACHE_HOME, else ~/.cache; without a home a folder of $TMPDIR, which `make` makes.

    Raises CaseError where somebody else has made that.
    """
    named, home = os.environ.get("XDG_CACHE_HOME", ""), os.environ.get("HOME", "")
    if os.path.isabs(named) and can_write(Path(named)):
        return Path(named)
    if os.path.isdir(home) and can_write(Path(home, ".cache")):
        return Path(home, ".cache")
    private = Path(tempfile.gettempdir()) / f"grainpair-{os.getuid()}"
    if make:
        if not os.path.lexists(private):
            private.mkdir(mode=0o700)
            print(
                f"grainpair: no home folder, so what is built and kept goes to {private}",
                file=sys.stderr,
            )
        about = private.lstat()
        if private.is_symlink() or about.st_uid != os.getuid() or about.st_mode & 0o022:
            raise CaseError(
                f"{private}: others may write there (it stands in for a home folder) "
                "set XDG_CACHE_HOME"
            )
    return private


def plain(name: str) -> bool:
    """Whether a name means itself to whatever reads it."""
    return re.fullmatch(f"[A-Za-z0-9{MARKS}]+", name) is not None


def short(path: Path) -> Path:
    """A path as a user in the project's folder types it."""
    path = path.resolve()
    return path.relative_to(ROOT) if path.is_relative_to(ROOT) else path


def name_of(case: Path) -> str:
    """What a case is called: its folder's name, or its file's when that is not case.toml."""
    case = case.resolve()
    return case.parent.name if case.name == "case.toml" else case.stem
