"""Runs a piece of engine work on several ranks, as process.py does in one process.

    mpirun -np N python3 -m dem_reference.ranks FILE    # one rank of it; FILE: what it is to do

The ranks say how far they are as JSON lines on standard output, and what came of it in files beside
FILE, each in its own.
"""

import importlib
import importlib.util
import json
import os
import pickle
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cases import children
from cases.errors import EngineError
from cases.programs import module, unstarted
from cases.scratch import temporary

from .process import (
    Done,
    Report,
    Voice,
    home,
    last_error,
    outcome_of,
    refuse_full_disk,
    stopped,
)

ASKED, OUTCOME = "asked", "outcome-{}"  # files of the ranks, beside the log
# Begin the names of what MPI tells its ranks in their environment (mpm/programs/start_ranks.cpp).
RANK = "PMIX_RANK"
SETTINGS_OF_RANKS = ("OMPI_MCA_ess", "OMPI_MCA_pmix", "OMPI_MCA_orte_")
TOLD_BY_MPI = ("PMIX_", "ORTE_", "OMPI_COMM_", "OMPI_APP_", *SETTINGS_OF_RANKS)


def mpirun(ranks: int) -> list[str]:
    """Words before a program that is to be on so many ranks; EngineError where MPI is not there."""
    if not shutil.which("mpirun"):
        raise unstarted("mpirun", FileNotFoundError())
    words = ["--oversubscribe", "--bind-to", "none", "--mca", "mpi_yield_when_idle", "1"]
    return ["mpirun", *words, "-np", str(ranks)] + ["--allow-run-as-root"] * (os.geteuid() == 0)


def outside_of_mpi() -> dict[str, str]:
    """The environment without what MPI tells its ranks there: of a program that has loaded it, or
    is a rank itself, mpirun would ask for a place in that one's world, and end without a word.
    """
    if RANK not in os.environ:  # settings that the user has made stay
        return dict(os.environ)
    return {name: word for name, word in os.environ.items() if not name.startswith(TOLD_BY_MPI)}


def refuse_without_mpi(script: bool = False) -> None:
    """EngineError where ranks cannot be had, of Python or of a script."""
    mpirun(1)
    if not script and importlib.util.find_spec("mpi4py") is None:
        raise EngineError(
            "mpi4py: no such module (not installed) install the package python3-mpi4py"
        )


def run_on_ranks(
    work: Callable,
    *arguments: Any,
    ranks: int,
    log: Path,
    report: Report = lambda done, text: None,
) -> Done:
    """Calls work(world, *arguments, voice) on every rank, as process.run_engine does in its child;
    what the first rank returns, and the processor time of all [s].

    `log` lies in a folder that all ranks see, for files of their own. Raises what one of them
    raised of CaseError and EngineError, or EngineError with the engine's last words.
    """
    refuse_without_mpi()
    folder, screen = log.parent, log.with_name("errors")
    arguments = tuple(one.resolve() if isinstance(one, Path) else one for one in arguments)
    (folder / ASKED).write_bytes(
        pickle.dumps((called(work), arguments, os.fspath(screen.resolve())))
    )
    for old in folder.glob(OUTCOME.format("*")):
        old.unlink()
    words = [*mpirun(ranks), *module("dem_reference.ranks", (folder / ASKED).resolve())]
    with temporary() as for_mpi, screen.open(
        "w"
    ) as said:  # MPI leaves what it needs if it is killed
        around = outside_of_mpi() | {"HOME": home(), "TMPDIR": str(for_mpi)}
        engine = children.start(words, stdout=subprocess.PIPE, stderr=said, env=around, text=True)
        try:
            for line in engine.stdout:
                if not heard(line, report):  # MPI's own words, which tell of its failures alone
                    said.write(line)
                    said.flush()
            engine.wait()
        finally:
            children.end(engine)
            engine.stdout.close()
    found = [pickle.loads(path.read_bytes()) for path in sorted(folder.glob(OUTCOME.format("*")))]
    for kind, *rest in found:
        if kind == "failed":
            error, text = rest
            raise error(text)
    if engine.returncode or len(found) < ranks:
        refuse_full_disk(folder)
        code = engine.returncode  # of a rank that a signal ended mpirun tells as a shell does
        raise stopped(128 - code if code > 128 else code, last_error(log, screen))
    return Done(found[0][1], sum(seconds for _, _, seconds in found))


def called(work: Callable) -> tuple[str, str]:
    """Module and name of a function, also of one whose module was started as a program."""
    started = sys.modules["__main__"].__spec__ if work.__module__ == "__main__" else None
    return started.name if started else work.__module__, work.__qualname__


def heard(line: str, report: Report) -> bool:
    """Whether a rank has said this line; passes it on."""
    try:
        kind, *rest = json.loads(line)
    except (ValueError, TypeError):
        return False
    if kind == "progress":
        report(*rest)
    elif kind == "warned":
        print(*rest, file=sys.stderr, flush=True)
    return True


class Lines:
    """Sends what a Voice says as lines to an open file."""

    def __init__(self, handle: int):
        self._handle = handle

    def send(self, message: tuple) -> None:
        os.write(self._handle, f"{json.dumps(message)}\n".encode())


class Silence:
    """Says nothing: of all ranks one speaks."""

    def send(self, message: tuple) -> None:
        pass


def main(file: Path) -> None:
    """One rank."""
    children.die_with(os.getppid())  # mpirun, or what it has started on this machine
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)  # nothing of ours is to be cleared up
    import mpi4py

    mpi4py.rc.threads = False
    from mpi4py import MPI

    from .world import World

    world = World(MPI)
    (source, name), arguments, screen = pickle.loads(file.read_bytes())
    told = os.dup(1)
    handle = os.open(screen, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.dup2(handle, 1)  # MPI's and the engine's own words
    os.dup2(handle, 2)
    voice = Voice(Lines(told) if world.first else Silence())
    work = getattr(importlib.import_module(source), name)
    outcome = outcome_of(work, (world, *arguments, voice), file.parent)
    part = file.with_name(f"part-{world.rank}")
    part.write_bytes(pickle.dumps(outcome))
    part.rename(file.with_name(OUTCOME.format(world.rank)))
    if outcome[0] == "failed":
        world.all.Abort(3)
    world.all.Barrier()
    MPI.Finalize()
    os._exit(0)  # without the engine's farewell


if __name__ == "__main__":
    main(Path(sys.argv[1]))
