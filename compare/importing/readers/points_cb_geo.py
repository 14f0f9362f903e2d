"""Material points of CB-Geo's mpm: HDF5 files `particles….h5` with a table of records
(include/hdf5_particle.h there), or the same columns as data sets. Tension is positive.
"""

from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import h5py
import numpy as np

from cases import reading
from cases.errors import CaseError
from compare.importing import points
from compare.importing.frame import Frame, note
from compare.importing.registry import Reader, register

MAGIC = b"\x89HDF"
NAMES = {
    **{f"coord_{axis}": axis for axis in "xyz"},
    **{f"velocity_{axis}": f"v{axis}" for axis in "xyz"},
    **{f"stress_{axis}{axis}": f"s{axis}{axis}" for axis in "xyz"},
    **{"tau_xy": "sxy", "tau_yz": "syz", "tau_xz": "szx"},
    **{name: name for name in ("id", "mass", "volume", "void_ratio")},
}
NEEDED = {"coord_x", "coord_y"}


def recognises(path: Path, head: bytes) -> bool:
    if not head.startswith(MAGIC):
        return False
    try:
        with h5py.File(path) as file:
            return table_of(file) is not None
    except reading.UNEXPECTED:
        return False


def table_of(file: h5py.Group) -> dict[str, h5py.Dataset] | h5py.Dataset | None:
    """The records, at the root or a group below it; None if there are none."""
    root = dict(file.items())
    below = (dict(one.items()) for one in root.values() if isinstance(one, h5py.Group))
    for place in chain([root], below):
        columns = {name: one for name, one in place.items() if isinstance(one, h5py.Dataset)}
        for one in columns.values():
            if NEEDED <= set(one.dtype.names or ()):
                return one
        if NEEDED <= columns.keys():
            return columns
    return None


def frames(path: Path, options: dict) -> Iterator[Frame]:
    """The one frame of a file; its step is the last number in the file's name. Points that have
    left the mesh, whose status is zero, are left out.
    """
    with reading.result(path) as file:
        table = table_of(file)
        if table is None:
            raise CaseError(f"{path}: no table of particles with coord_x and coord_y")
        names = table.dtype.names if isinstance(table, h5py.Dataset) else table
        parts = [table] if isinstance(table, h5py.Dataset) else list(table.values())
        for one in parts:
            if one.size is not None and one.nbytes > reading.DENSEST * one.id.get_storage_size():
                raise CaseError(f"{reading.where(one)}: holds less than it says (cut short?)")
        found = {name: np.asarray(table[name][()]) for name in names if name in NAMES}
        inside = np.asarray(table["status"][()]) != 0 if "status" in names else None
        count = len(found["coord_x"])
    if inside is not None and inside.shape != (count,):
        raise CaseError(f"{path}: status has shape {inside.shape}, coord_x ({count},)")
    if inside is not None and not inside.all():
        if any(values.shape != (count,) for values in found.values()):
            raise CaseError(f"{path}: columns of several lengths")
        found = {name: values[inside] for name, values in found.items()}
        note(options, f"{path}: {(~inside).sum()} points outside the mesh were left out")
    columns = {NAMES[name]: values for name, values in found.items()}
    frame = points.completed(Frame(str(path), columns, points.step_of(path), compression=False))
    yield frame


register(Reader("cb_geo", "CB-Geo mpm particles (HDF5)", "points", recognises, frames))
