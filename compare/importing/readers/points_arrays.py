"""Material points in NumPy's files: `.npz` as GeoTaichi and scripts of Taichi save them. Arrays
that need pickle are never loaded.
"""

import warnings
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cases.errors import CaseError
from compare.importing import points
from compare.importing.frame import Frame
from compare.importing.registry import Reader, register

ZIP = b"PK\x03\x04"


def recognises(path: Path, head: bytes) -> bool:
    return head.startswith(ZIP) and b".npy" in head[:200]


def frames(path: Path, options: dict) -> Iterator[Frame]:
    """The one frame of a file; its step is the last number in the file's name."""
    arrays = {}
    try:
        with (
            warnings.catch_warnings(),
            open(path, "rb") as raw,
            np.load(raw, allow_pickle=False) as file,
        ):
            warnings.simplefilter("error")  # of entries over one another
            for name in file.files:
                try:
                    arrays[name] = file[name]
                except ValueError:  # an array of objects
                    continue
    except (
        OSError,
        ValueError,
        EOFError,
        KeyError,
        MemoryError,  # of a length that is only said
        NotImplementedError,
        RuntimeError,
        UserWarning,
        zipfile.BadZipFile,
        zlib.error,
    ) as error:
        raise CaseError(f"{path}: cannot be read as .npz ({error})") from error
    frame = points.frame_of(arrays, str(path))
    frame.step = points.step_of(path) if frame.step is None else frame.step
    yield frame


register(Reader("points_npz", "NumPy arrays of points (.npz)", "points", recognises, frames))
