"""Room on a disk: what cannot have it is refused beforehand, and where it runs out, that is one
line. cases/room.hpp says the same.
"""

from __future__ import annotations

import errno
import math
import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cases.errors import EngineError, Failed

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class NoRoom(EngineError):
    """No room on a disk: the same may go well later."""

    @staticmethod
    def says(line: str) -> bool:
        """Whether a program's last word is that."""
        return ": no room (" in line


def free(path: Path) -> float:
    """[bytes] for a file or folder that need not be there yet; endless where nobody can tell, as in
    the kernel's own folders.
    """
    there = next(one for one in (path, *path.absolute().parents) if one.exists())
    usage = shutil.disk_usage(there)
    return usage.free if usage.total else math.inf


def code_of(error: BaseException) -> int:
    """The system's errno of a failure; 0 where it is not the system's. HDF5 tells it in words."""
    if isinstance(error, OSError) and error.errno:
        return error.errno
    found = re.search(r"errno = (\d+), error message", str(error))
    return int(found[1]) if found else 0


def is_full(error: BaseException) -> bool:
    return code_of(error) in FULL


def lacking(path: Path, error: BaseException | None = None, needs: float = 0.0) -> NoRoom:
    """No room for `path`: because of a failure, or since it `needs` more [bytes] than is free."""
    there = free(path)
    why = [os.strerror(code_of(error))] if error else []
    if needs > there:
        why.append(f"needs about {needs / 1e6:.3g} MB")
    return NoRoom(
        f"{path}: no room ({'; '.join(why)}, {there / 1e6:.3g} MB free) free some room, or write "
        "elsewhere"
    )


def refuse_lack(path: Path, needs: float):
    """Raises EngineError where less than it `needs` [bytes] is free for a file or folder."""
    if free(path) < needs:
        raise lacking(path, needs=needs)


@contextmanager
def enough(path: Path, needs: float = 0.0) -> Iterator[None]:
    """Raises EngineError where room runs out in the block, which writes `path`, whatever library
    says so.
    """
    try:
        yield
    except Failed:
        raise
    except Exception as error:
        if not is_full(error):
            raise
        raise lacking(path, error, needs) from error


def settle(path: Path):
    """Waits until a file, or the names in a folder, are on the disk: some file systems tell only
    then that it does not fit. Raises OSError.
    """
    handle = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
