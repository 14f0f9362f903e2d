"""Runs a piece of engine work in a process of its own: LIGGGHTS ends its process on any error, and holds one run only."""

import multiprocessing
import os
import resource
import signal
import sys
from collections.abc import Callable
from pathlib import Path

from cases.errors import CaseError, EngineError, Failure


def _child(pipe, work: Callable, arguments: tuple, errors: Path) -> None:
    handle = os.open(errors, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(handle, 1)  # MPI's and the engine's own words
    os.dup2(handle, 2)
    try:
        work(*arguments, lambda done, text: pipe.send(("progress", done, text)))
        usage = resource.getrusage(resource.RUSAGE_SELF)
        pipe.send(("done", usage.ru_utime + usage.ru_stime))
    except (CaseError, EngineError) as error:
        pipe.send(("failed", type(error), str(error)))
    pipe.close()
    sys.stdout.flush()
    os._exit(0)  # without MPI's farewell


def run_engine(
    work: Callable, arguments: tuple, log: Path, report: Callable[[float, str], None]
) -> float:
    """Calls work(*arguments, report) in a child process; returns its CPU seconds.

    Raises what the child raised; EngineError with the last error line of `log` when the engine took the child down.
    """
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    errors = log.with_name("errors")
    child = context.Process(target=_child, args=(theirs, work, arguments, errors))
    child.start()
    theirs.close()
    outcome = None
    try:
        while True:
            kind, *rest = ours.recv()
            if kind == "progress":
                report(*rest)
            else:
                outcome = kind, rest
    except EOFError:
        pass
    except BaseException:
        child.terminate()
        raise
    finally:
        child.join()
    if outcome and outcome[0] == "done":
        return outcome[1][0]
    if outcome:
        kind, text = outcome[1]
        raise kind(text)
    raise stopped(child.exitcode, last_error(log, errors))


def stopped(exit_code: int | None, words: str) -> EngineError:
    """The engine ended with `exit_code` after these last words; our codes are told from them."""
    code = None
    if exit_code == -signal.SIGXCPU:
        code = Failure.CPU_LIMIT
    elif "Lost atoms" in words:
        code = Failure.LOST_GRAINS
    return EngineError(f"LIGGGHTS: stopped with code {exit_code} ({words})", code)


def last_error(log: Path, errors: Path) -> str:
    """The engine's own last words: the last line that says ERROR, else the last line of what was written to the screen."""
    lines = []
    for path in (errors, log):
        if path.exists():
            lines += path.read_text(errors="replace").splitlines()
    said = [line.strip() for line in lines if "ERROR" in line] or [
        line.strip() for line in lines if line.strip()
    ]
    return "".join(c for c in said[-1] if c.isprintable()) if said else "it said nothing"
