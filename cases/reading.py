"""Result files as they are opened to be read: what cannot be is told in one line."""

import os
import stat
from pathlib import Path

import h5py

from cases.errors import CaseError


def opened(path: str | Path) -> h5py.File:
    """An HDF5 file to read. Raises CaseError with the reason where that cannot be."""
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):
            raise CaseError(f"{path}: cannot be read (not a file)")
        with open(path, "rb"):
            return h5py.File(path, "r")
    except BlockingIOError as error:
        why = "another process is writing it; wait until that has ended"
        raise CaseError(f"{path}: cannot be read ({why})") from error
    except OSError as error:
        named = error.strerror if error.filename else None  # the system's words, not HDF5's
        raise CaseError(f"{path}: cannot be read ({named or 'not HDF5, or cut short'})") from error
