"""Small file systems in memory, and programs that run out of room on them."""

import atexit
import ctypes
import os
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

PAGE = 4096  # [bytes]
AMPLE = "64m"


class Done(NamedTuple):
    """A program that has ended: its exit code, or minus the signal, and what it said."""

    code: int
    said: str


class Disk:
    """A file system in memory at `folder`, for a block; skips the test where none can be had."""

    def __init__(self, folder: Path):
        self.folder = folder
        folder.mkdir()

    def __enter__(self) -> "Disk":
        if why := self.mount("-t", "tmpfs", "-o", f"size={AMPLE}", "tmpfs"):
            pytest.skip(f"no small file system to fill ({why})")
        (self.folder / "page").write_text("something")  # of no size there are no small ones
        return self

    def mount(self, *words: str) -> str:
        done = subprocess.run(
            ["mount", *words, str(self.folder)], capture_output=True, text=True, check=False
        )
        return done.stderr.strip().splitlines()[0] if done.returncode else ""

    def __exit__(self, *_):
        subprocess.run(["umount", "--lazy", str(self.folder)], check=True)

    def used(self) -> int:
        """[bytes]"""
        found = os.statvfs(self.folder)
        return (found.f_blocks - found.f_bfree) * found.f_frsize

    def leave(self, free: float):
        """So many bytes, to the page."""
        size = self.used() + PAGE * round(free / PAGE)
        assert not self.mount("-o", f"remount,size={size}")

    def peak_of(self, work: Callable) -> tuple[Done, int]:
        """What `work` returns, and the most that it has on this disk meanwhile [bytes]."""
        before, most, ended = self.used(), 0, threading.Event()

        def look():
            nonlocal most
            while not ended.is_set():
                most = max(most, self.used() - before)
                time.sleep(0.0005)

        looking = threading.Thread(target=look)
        looking.start()
        try:
            done = work()
            return done, max(most, self.used() - before + PAGE)  # an earlier file of a page is gone
        finally:
            ended.set()
            looking.join()


def forked(main: Callable[[], int]) -> Done:
    """A program of Python in a copy of this process, which need not load all of it again; it ends
    as one that was started does, libraries and all.
    """
    ours, theirs = os.pipe()
    child = os.fork()
    if not child:
        code = 1
        try:
            os.dup2(theirs, 2)
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            for handle in (ours, theirs):  # which need not be neighbours
                os.close(handle)
            # pytest's own are others
            sys.stdout, sys.stderr = (open(handle, "w", closefd=False) for handle in (1, 2))
            code = main()
        except BaseException:
            traceback.print_exc()
        sys.stderr.flush()
        atexit._run_exitfuncs()
        ctypes.CDLL(None).exit(code)
    os.close(theirs)
    with open(ours) as pipe:
        said = pipe.read()
    _, status = os.waitpid(child, 0)
    return Done(os.waitstatus_to_exitcode(status), said)


def started(words: list[str], first: Callable) -> Done:
    """A program, in whose process `first` is called before it starts."""
    done = subprocess.run(
        words,
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=first,
        restore_signals=False,
    )
    return Done(done.returncode, done.stderr)
