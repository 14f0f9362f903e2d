"""Runs a piece of engine work in a process of its own.

LIGGGHTS ends its process on any error, and holds one simulation only.
"""

import errno
import multiprocessing
import os
import resource
import signal
import sys
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

from cases import children, room
from cases.errors import CaseError, EngineError, Failed, Failure
from cases.scratch import reason

LEAST_ROOM = 1e6  # [bytes] with less of it an engine's end is put down to the disk

Report = Callable[[float, str], None]  # takes the fraction done and a few words


class Interrupted(EngineError):
    """Somebody ended the engine: nothing is wrong with the run."""


def fails_again(error: BaseException) -> bool:
    """Whether the same command would fail by it again: not where it was interrupted, or the disk is
    full.
    """
    return isinstance(error, Failed) and not isinstance(error, (Interrupted, room.NoRoom))


class Voice:
    """How a child tells its parent of its work: it is a Report, and it can warn."""

    def __init__(self, pipe: Any):
        """pipe: a Connection, or what sends as one does."""
        self._pipe = pipe

    def __call__(self, done: float, text: str) -> None:
        self._pipe.send(("progress", done, text))

    def warn(self, line: str) -> None:
        """Has the parent say a line on standard error."""
        self._pipe.send(("warned", line))


class Done(NamedTuple):
    """What a piece of work returned, and what it cost."""

    result: Any
    cpu_seconds: float


def run_engine(
    work: Callable, *arguments, log: Path, report: Report = lambda done, text: None
) -> Done:
    """Calls work(*arguments, voice) in a child process that may use the engine.

    `work` is a function of a module, and what it takes and returns can be pickled; paths reach it
    complete, because the engine moves to the folder of its log. Raises what the
    child raised of CaseError and EngineError; EngineError with the engine's own last words, from
    `log` or its screen, when it took the child down.
    """
    arguments = tuple(one.resolve() if isinstance(one, Path) else one for one in arguments)
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    screen = log.with_name("errors")
    child = context.Process(target=_child, args=(os.getpid(), theirs, work, arguments, screen))
    child.start()
    theirs.close()
    outcome = None
    try:
        while True:
            kind, *rest = ours.recv()
            if kind == "progress":
                report(*rest)
            elif kind == "warned":
                print(*rest, file=sys.stderr, flush=True)
            else:
                outcome = kind, rest
    except EOFError:
        pass
    except BaseException:
        child.terminate()
        raise
    finally:
        child.join()
    if outcome is None:
        refuse_full_disk(log.parent)
        raise stopped(child.exitcode, last_error(log, screen))
    kind, rest = outcome
    if kind == "done":
        return Done(*rest)
    error, text = rest
    raise error(text)


def _child(parent: int, pipe: Connection, work: Callable, arguments: tuple, screen: Path) -> None:
    children.die_with(parent)
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # as whoever is interrupted, not as who fails
    os.environ["HOME"] = home()
    handle = os.open(screen, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(handle, 1)  # MPI's and the engine's own words
    os.dup2(handle, 2)
    pipe.send(outcome_of(work, (*arguments, Voice(pipe)), screen.parent))
    pipe.close()
    sys.stdout.flush()
    os._exit(0)  # without MPI's farewell


def outcome_of(work: Callable, arguments: tuple, folder: Path) -> tuple:
    """What a piece of work that goes on in `folder` comes to: "done", what it returned and its
    processor time [s]; or "failed", and the error's type and line, where it is one of those that we
    tell. Others it raises.
    """
    try:
        result = work(*arguments)
        usage = resource.getrusage(resource.RUSAGE_SELF)
        return "done", result, usage.ru_utime + usage.ru_stime
    except (CaseError, EngineError) as error:
        return "failed", type(error), str(error)
    except MemoryError:
        return "failed", EngineError, "LIGGGHTS: out of memory choose larger grains"
    except Exception as error:
        what = getattr(error, "filename2", "") or getattr(error, "filename", "") or folder
        if room.is_full(error):
            return "failed", room.NoRoom, str(room.lacking(Path(what), error))
        if isinstance(error, OSError):
            return "failed", EngineError, f"{what}: cannot be written ({reason(error)})"
        raise


def home() -> str:
    """The variable HOME as it is, or made up: Open MPI 5 does not start without."""
    found = os.path.expanduser("~")
    return found if os.path.isabs(found) else "/"


def refuse_full_disk(folder: Path) -> None:
    """Engines do not tell why they cannot write, and may crash over it. Raises EngineError where
    there is no room.
    """
    if room.free(folder) < LEAST_ROOM:
        raise room.lacking(folder, OSError(errno.ENOSPC, ""))


def stopped(exit_code: int | None, words: str) -> EngineError:
    """The engine ended with `exit_code` after these last words; our codes are told from them."""
    code = None
    if exit_code == -signal.SIGXCPU:
        code = Failure.CPU_LIMIT
    elif "Lost atoms" in words:
        code = Failure.LOST_GRAINS
    ended = exit_code in (-signal.SIGKILL, -signal.SIGTERM, -signal.SIGINT)
    kind = Interrupted if ended else EngineError
    return kind(f"LIGGGHTS: stopped with code {exit_code} ({words})", code)


def last_error(log: Path, screen: Path) -> str:
    """The engine's last words: the last line that says ERROR, else the last line of its screen."""
    lines: list[str] = []
    for path in (screen, log):
        if path.exists():
            lines += path.read_text(errors="replace").splitlines()
    said = [line.strip() for line in lines if "ERROR" in line] or [
        line.strip() for line in lines if line.strip()
    ]
    return said[-1] if said else "it said nothing"
