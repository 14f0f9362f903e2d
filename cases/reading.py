"""Result files as they are opened and read: what cannot be is told in one line.

A path is of a file, a `place` of what is in it: "data/0/particles/cloud/mass".
"""

import os
import stat
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np

from cases.errors import CaseError
from cases.openpmd import SCHEMA_VERSION

# What h5py raises where a file is not as it is meant to be; of memory where it says to hold more.
UNEXPECTED = (
    *(OSError, KeyError, ValueError, TypeError, AttributeError, IndexError, RuntimeError),
    MemoryError,
)
LARGEST = 2.0**53  # whole numbers up to it are exact
DENSEST = 1040  # bytes that deflate can make of one, at most


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


@contextmanager
def result(path: str | Path) -> Iterator[h5py.File]:
    """The same of a result file, for a block that reads it: of a version that is known, and what
    h5py stumbles over in the block is a CaseError too.
    """
    try:
        with opened(path) as file:
            version = plain(file.attrs.get("schema_version", 1))
            if not is_number(version) or not version <= SCHEMA_VERSION:
                raise CaseError(
                    f"{path}: schema_version is {version!r} (this grainpair reads up to "
                    f"{SCHEMA_VERSION}) take a newer grainpair"
                )
            yield file
    except UNEXPECTED as error:
        words = " ".join(str(error).split()) or type(error).__name__
        raise CaseError(f"{path}: not a result file that can be read ({words})") from error


def attributes(thing: h5py.HLObject) -> dict:
    """All attributes, text as str."""
    return {name: plain(value) for name, value in thing.attrs.items()}


def plain(value):
    """An attribute as Python's own, which is told without the name of its type."""
    value = value.item() if isinstance(value, np.generic) else value
    return value.decode() if isinstance(value, bytes) else value


def is_number(value) -> bool:
    """One real number, and no text or array."""
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def whole(parent: h5py.Group, place: str, length: int | None = None) -> np.ndarray:
    """The whole numbers (N,) of a column, int64."""
    found = values(parent, place, length)
    wrong = np.flatnonzero((found != np.trunc(found)) | (np.abs(found) > LARGEST))
    if wrong.size:
        at = Place(parent, place)
        raise CaseError(f"{at}: row {wrong[0]} is {found[wrong[0]]:.17g} (no whole number)")
    return found.astype(np.int64)


def number(thing: h5py.HLObject, name: str) -> float:
    """An attribute that is one finite number."""
    value = thing.attrs.get(name)
    if value is None:
        raise CaseError(f"{where(thing)}: no attribute {name}")
    if not is_number(value) or not np.isfinite(value):
        raise CaseError(f"{where(thing)}: attribute {name} is {plain(value)!r} (no finite number)")
    return float(value)


def where(thing: h5py.HLObject) -> str:
    return f"{thing.file.filename}:{thing.name}"


class Place(NamedTuple):
    """Where something is, in words once they are needed: to look for them takes a while."""

    parent: h5py.Group
    place: str

    def __str__(self) -> str:
        return f"{where(self.parent).rstrip('/')}/{self.place}"


def group(parent: h5py.Group, place: str) -> h5py.Group:
    """A group that must be there."""
    found = parent.get(place)
    if not isinstance(found, h5py.Group):
        problem = "missing" if found is None else "not a group"
        raise CaseError(f"{Place(parent, place)}: {problem}")
    return found


def column(parent: h5py.Group, place: str, length: int | None = None) -> h5py.HLObject:
    """A one-dimensional dataset of numbers, or an openPMD constant component (a group with `value`
    and `shape`), in SI units and of `length` where that is given; nothing of it is read yet.
    """
    found, at = parent.get(place), Place(parent, place)
    if found is None:
        raise CaseError(f"{at}: missing")
    if constant := isinstance(found, h5py.Group):
        kind = np.asarray(found.attrs.get("value", "")).dtype
        told = np.atleast_1d(found.attrs.get("shape", ()))
        if told.dtype.kind not in "iuf" or not np.all(np.isfinite(told)):
            raise CaseError(f"{at}: not a dataset of numbers (of a shape that is no number)")
        shape = tuple(int(n) for n in told)
    else:
        shape, kind = found.shape or (), found.dtype
    if kind.kind not in "iuf":
        words = "a group without value" if constant else kind.name
        raise CaseError(f"{at}: not a dataset of numbers ({words})")
    if len(shape) != 1:
        raise CaseError(f"{at}: of {len(shape)} dimensions, not of one")
    if not constant and shape[0] * kind.itemsize > DENSEST * found.id.get_storage_size():
        raise CaseError(f"{at}: holds fewer numbers than it says (cut short?)")
    if length is not None and shape[0] != length:
        raise CaseError(f"{at}: of length {shape[0]}, the others are of {length}")
    unit = found.attrs["unitSI"] if "unitSI" in found.attrs else 1.0
    if not is_number(unit) or unit != 1.0:
        raise CaseError(f"{at}: unitSI is {plain(unit)!r} (only SI units are read: 1)")
    return found


def length(parent: h5py.Group, place: str, length: int | None = None) -> int:
    """How long a column is, which is `length` where that is given."""
    found = column(parent, place, length)
    return int(np.ravel(found.attrs["shape"])[0] if isinstance(found, h5py.Group) else len(found))


def values(
    parent: h5py.Group, place: str, length: int | None = None, finite: bool = True
) -> np.ndarray:
    """The numbers (N,) of a column; all of them finite, unless said otherwise."""
    found = column(parent, place, length)
    if isinstance(found, h5py.Group):
        out = np.full(int(np.ravel(found.attrs["shape"])[0]), found.attrs["value"])
    else:
        out = found[()]
    if finite and not np.all(np.isfinite(out)):
        first = int(np.flatnonzero(~np.isfinite(out))[0])
        raise CaseError(f"{where(found)}: row {first} is {out[first]} (not a finite number)")
    return out


def columns(
    parent: h5py.Group, names: Iterable[str], unknown: Collection[str] = ()
) -> dict[str, np.ndarray]:
    """Columns of one length by name; those `unknown` may hold NaN."""
    names = list(names)
    rows = length(parent, names[0])
    return {name: values(parent, name, rows, name not in unknown) for name in names}


def vectors(parent: h5py.Group, place: str, length: int | None = None) -> np.ndarray:
    """The numbers (N, 3) of a record with components x, y, z."""
    x = values(parent, f"{place}/x", length)
    return np.stack([x, *(values(parent, f"{place}/{k}", len(x)) for k in "yz")], axis=-1)
