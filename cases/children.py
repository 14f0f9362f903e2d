"""Programs that we start end with us, however we end: none is left to work for nobody."""

import ctypes
import os
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress

PATIENCE = 5.0  # [s] that a program has for its farewell
SET_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG of <sys/prctl.h>

_c = ctypes.CDLL(None)


def die_with(parent: int) -> None:
    """Has the kernel kill this process as soon as its parent, the process `parent`, has ended; at
    once where that is dead already.
    """
    _c.prctl(SET_DEATH_SIGNAL, int(signal.SIGKILL), 0, 0, 0)
    if os.getppid() != parent:
        os._exit(128 + signal.SIGKILL)


def start(command: list, *, before: Callable[[], None] | None = None, **options):
    """Starts a program that dies with this process, as subprocess.Popen with `options` does;
    `before` is called in it. Raises OSError where there is no such program.
    """
    parent = os.getpid()

    def begin() -> None:  # takes no lock, which another thread may have held at the fork
        die_with(parent)
        if options.get("start_new_session"):  # a shell's background job ignores it, and `end` asks
            signal.signal(signal.SIGINT, signal.SIG_DFL)
        if before:
            before()

    return subprocess.Popen([str(word) for word in command], preexec_fn=begin, **options)


def end(*processes: subprocess.Popen, group: bool = False) -> None:
    """Ends programs: by a request to all, and after some patience for good. Of leaders of a `group`
    (start_new_session) all that belong to it; Snakemake cancels a cluster's jobs when interrupted.
    """
    for number in (signal.SIGINT if group else signal.SIGTERM, signal.SIGKILL):
        for process in processes:
            tell(process, number, group)
        until = time.monotonic() + PATIENCE
        for process in processes:
            try:
                process.wait(timeout=max(0.0, until - time.monotonic()))
            except subprocess.TimeoutExpired:
                continue


def tell(process: subprocess.Popen, number: signal.Signals, group: bool) -> None:
    """Sends a signal to a program, or to all of its group: some may outlive their leader."""
    if group:
        with suppress(ProcessLookupError):  # all have ended
            os.killpg(process.pid, number)
    elif process.poll() is None:
        process.send_signal(number)
