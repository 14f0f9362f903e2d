"""HDF5 files that are written.

HDF5 must not meet a full disk: it writes much of a file only when something in it is closed, where
h5py can but print what fails, and what it cannot write it keeps open, over which the process
crashes at its end. So the bytes go through a file of ours, which takes all and tells later.
"""

import fcntl
import io
from pathlib import Path

import h5py


class Disk(io.FileIO):
    """What does not fit is dropped, with all that comes after it; `failure` says why."""

    failure: OSError | None = None

    def write(self, data) -> int:
        left = memoryview(data).cast("B")
        count = len(left)
        while len(left) and not self.failure:
            try:
                left = left[super().write(left) or 0 :]
            except OSError as error:
                self.failure = error
        return count

    def truncate(self, size: int | None = None) -> int:
        if not self.failure:
            try:
                return super().truncate(size)
            except OSError as error:
                self.failure = error
        return size or 0


class H5Output(h5py.File):
    """A file to write: flush() and close() raise OSError where what was written did not fit."""

    def __init__(self, path: Path, mode: str = "w", **options):
        self.disk = Disk(path, "w+" if mode == "w" else "r+")
        fcntl.flock(self.disk, fcntl.LOCK_EX)  # as HDF5 would: who reads it too early is told
        super().__init__(self.disk, mode, **options)

    def flush(self):
        """Brings all into the file, which can be read up to here if the process is killed later
        (after h5clear -s).
        """
        try:
            super().flush()
        finally:
            self.tell()

    def close(self):
        """The file is closed all the same."""
        try:
            if self:
                super().close()
        finally:
            self.disk.close()
            self.tell()

    def tell(self):
        if self.disk.failure:
            raise self.disk.failure
