"""Material points of CB-Geo's mpm: HDF5 files `particles….h5` with a table of records
(include/hdf5_particle.h there), or the same columns as data sets. Tension is positive.
"""

from collections.abc import Iterator
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


def table_of(file: h5py.Group) -> dict[str, np.ndarray] | h5py.Dataset | None:
    """The records, at the root or a group below it; None if there are none."""
    places = [file, *(one for one in file.values() if isinstance(one, h5py.Group))]
    for place in places:
        for one in place.values():
            if isinstance(one, h5py.Dataset) and one.dtype.names and NEEDED <= set(one.dtype.names):
                return one
        if NEEDED <= {name for name, one in place.items() if isinstance(one, h5py.Dataset)}:
            return {name: one for name, one in place.items() if isinstance(one, h5py.Dataset)}
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
        found = {name: np.asarray(table[name][()]) for name in names if name in NAMES}
        inside = np.asarray(table["status"][()]).astype(bool) if "status" in names else None
    if inside is not None and not inside.all():
        found = {name: values[inside] for name, values in found.items()}
        note(options, f"{path}: {(~inside).sum()} points outside the mesh were left out")
    columns = {NAMES[name]: values for name, values in found.items()}
    frame = points.completed(Frame(str(path), columns, points.step_of(path), compression=False))
    yield frame


register(Reader("cb_geo", "CB-Geo mpm particles (HDF5)", "points", recognises, frames))
