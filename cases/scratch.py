"""Locks, and folders for what is not complete yet.

The kernel drops a lock with the process that holds it, however that ends: so what a dead process
has left is told from what a living one works on. cases/draft.cpp has the same lock.
"""

from __future__ import annotations

import datetime
import fcntl
import glob
import os
import platform
import re
import shlex
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cases import room
from cases.errors import CaseError, Failed, printable

CHARACTERS = 200  # of a command in a message


def reason(error: OSError) -> str:
    """The system's words for a failure, without the library's around them."""
    return os.strerror(error.errno) if error.errno else str(error)


@contextmanager
def told(path: Path) -> Iterator[None]:
    """Says failures of the file system in one line: CaseError where `path` is no place to write
    to, EngineError where room ran out.
    """
    try:
        with room.enough(path):
            yield
    except BrokenPipeError:  # nobody listens any more
        raise
    except OSError as error:
        raise CaseError(
            f"{path}: cannot be written ({reason(error)}) choose another place"
        ) from error


@contextmanager
def named(work: Path, what: Path) -> Iterator[None]:
    """Failures that tell of a file in the scratch folder `work` tell of `what` instead."""
    try:
        yield
    except Failed as error:
        line = re.sub(re.escape(str(work)) + r"[^\s:]*", lambda _: str(what), str(error))
        raise type(error)(line) from error


@contextmanager
def made_folders(folder: Path) -> Iterator[None]:
    """Makes a folder and those that lead to it; they are removed again where the block fails and
    they are empty. Raises OSError.
    """
    new: list[Path] = []
    for one in (folder, *folder.parents):
        if one.exists():
            break
        new.append(one)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:
        for one in new:
            try:
                one.rmdir()
            except OSError:
                break
        raise


def take(path: Path) -> int | None:
    """The open file `path`, made where it is not there, with its lock; None where another process
    holds that. Raises OSError.
    """
    while True:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if is_at(handle, path):
                return handle
        except BlockingIOError:
            os.close(handle)
            return None
        except OSError:
            os.close(handle)
            raise
        os.close(handle)  # its last owner has removed it meanwhile


def is_at(handle: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(handle), os.stat(path))
    except FileNotFoundError:
        return False


def self_told() -> str:
    """Who works here, in one line."""
    words = shlex.join(getattr(sys, "orig_argv", sys.argv))
    words = printable(words)[:CHARACTERS]
    now = datetime.datetime.now().strftime("%Y-%m-%d %H:%M:%S")
    return f"process {os.getpid()} (started {now} on {platform.node()}: {words})"


@contextmanager
def locked(path: Path, what: Path, text: str = "") -> Iterator[None]:
    """Holds the lock file `path`, which is removed at the end; it holds `text`, or who works here.
    Raises CaseError, which tells that, where another process works on `what`.
    """
    handle = take(path)
    if handle is None:
        try:
            owner = path.read_text(errors="replace").strip()
        except OSError:
            owner = ""
        raise CaseError(
            f"{what}: in use by {owner or 'another process'} wait for it, or choose another place"
        )
    try:
        os.truncate(handle, 0)
        os.write(handle, f"{text or self_told()}\n".encode())
        yield
    finally:
        path.unlink(missing_ok=True)
        os.close(handle)


@contextmanager
def scratch(folder: Path, name: str) -> Iterator[Path]:
    """An empty folder inside `folder` for the making of `name`, removed at the end. What dead
    processes have left of theirs is removed first. Raises OSError.
    """
    prefix = f".{name}.scratch-"
    for old in folder.glob(f"{glob.escape(prefix)}*"):
        remove_dead(old)
    while True:
        made = Path(tempfile.mkdtemp(prefix=prefix, dir=folder.absolute()))
        try:
            handle = take(made / "lock")
        except FileNotFoundError:  # somebody has taken it for a dead one's: once more
            continue
        except OSError:
            shutil.rmtree(made, ignore_errors=True)
            raise
        if handle is not None:
            break
    try:
        work = made / "files"  # with the usual permissions, unlike a temporary folder
        work.mkdir()
        yield work
    finally:
        shutil.rmtree(made, ignore_errors=True)
        os.close(handle)


@contextmanager
def temporary() -> Iterator[Path]:
    """An empty folder where the machine keeps what is not kept, removed at the end; those that
    killed processes of ours have left go with it.
    """
    with scratch(Path(tempfile.gettempdir()), "grainpair") as work:
        yield work


def remove_dead(old: Path):
    """Removes a scratch folder, or a file with a lock, whose process has ended."""
    try:
        handle = take(old / "lock" if old.is_dir() else old)
    except OSError:
        return  # it is gone, or somebody else's
    if handle is not None:
        if old.is_dir():
            shutil.rmtree(old, ignore_errors=True)
        else:
            old.unlink(missing_ok=True)
        os.close(handle)
