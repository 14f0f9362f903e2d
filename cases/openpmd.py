"""openPMD 1.1.0 as our result files keep it: attributes, frames and records.

The standard's text is of fixed length: h5py's own is not, and no openPMD reader need take that. All
that Python writes into a result file goes through `describe`.
"""

import datetime
import platform
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np

from cases.h5_output import H5Output
from cases.provenance import commit

SCHEMA_VERSION = 1  # of our own part of the layout
# Powers of length, mass, time; those of current, temperature, amount and light are zero.
DIMENSIONS = {
    "m": (1, 0, 0),
    "m/s": (1, 0, -1),
    "kg": (0, 1, 0),
    "m3": (3, 0, 0),
    "kg/m3": (-3, 1, 0),
    "1/s": (0, 0, -1),
    "m2/s2": (2, 0, -2),
    "J/kg": (2, 0, -2),
    "Pa": (-1, 1, -2),
    "N": (1, 1, -2),
    "J": (2, 1, -2),
    "W": (2, 1, -3),
    "-": (0, 0, 0),
}
# What a record's numbers mean where its name and unit do not say it.
DOCS = {
    "kind": "1 moving grain, 3 glued grain (part of the wall)",
    "regime": "1 visco-elastic, 2 visco-elasto-plastic, 3 critical, 4 collisional, 0 none",
    "stress": "total, compression positive",
    "first": "id of the grain that the force acts on",
    "second": "id of the other grain; -1 left wall, -2 gate, -3 floor, -4 front, -5 back",
    "branch": "centre of first minus centre of second (nearest image), or minus contact point",
    "force": "on first",
}
PACKED: dict = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
COMPONENTS = {3: ("x", "y", "z"), 6: ("xx", "yy", "zz", "xy", "yz", "zx")}


def describe(thing: h5py.HLObject, told: Mapping | None = None, **more) -> None:
    """Attributes of a file, group or dataset: numbers as they are, text of fixed length. What is
    there already is replaced.
    """
    for name, value in {**(told or {}), **more}.items():
        if isinstance(value, (str, bytes)):
            text = value.encode() if isinstance(value, str) else value
            kind = h5py.string_dtype("ascii" if text.isascii() else "utf-8", max(len(text), 1))
            thing.attrs.create(name, np.array(text, kind))
        else:
            thing.attrs[name] = value


def create(path: Path, engine: str, told: Mapping) -> H5Output:
    """A new result file of `engine`, "mpm" or "dem", with the attributes of its root; `told` goes
    onto them.
    """
    # the format of HDF5 1.10: attributes longer than 64 kB, such as a long list of sources
    file = H5Output(path, libver=("v110", "v110"))
    today, version = datetime.datetime.now(datetime.timezone.utc), commit()
    own = {
        "openPMD": "1.1.0",
        "openPMDextension": np.uint32(0),
        "basePath": "/data/%T/",
        "particlesPath": "particles/",
        "iterationEncoding": "groupBased",
        "iterationFormat": "/data/%T/",
        "software": "grainpair",
        "softwareVersion": version,
        "date": today.strftime("%Y-%m-%d %H:%M:%S +0000"),
        "machine": platform.node() or "unknown",
        "schema_version": SCHEMA_VERSION,
        "engine": engine,
        "commit": version,
    }
    describe(file, own | dict(told))
    return file


def frame(file: h5py.File, step: int, time: float, dt: float) -> h5py.Group:
    """The group of one instant, at `time` [s]; its particles belong into `particles/cloud`. Those
    before are in the file by then. Raises OSError where they are not.
    """
    file.flush()
    group = file.create_group(f"data/{step}")
    describe(group, time=float(time), dt=float(dt), timeUnitSI=1.0)
    return group


def record(
    parent: h5py.Group,
    name: str,
    values: np.ndarray,
    unit: str,
    kind,
    doc: str = "",
    level: int = PACKED["compression_opts"],
) -> None:
    """A record of values (N,), of vectors (N, 3) or of symmetric tensors (N, 6) in the order xx yy
    zz xy yz zx, stored as type `kind`; `doc` for what DOCS does not say; `level` of compression, 0
    for none.
    """
    stored = packed(values, level)
    if values.ndim == 1:
        parts = [parent.create_dataset(name, data=values.astype(kind), **stored)]
        whole: h5py.HLObject = parts[0]
    else:
        whole = parent.create_group(name)
        parts = [
            whole.create_dataset(axis, data=values[:, k].astype(kind), **stored)
            for k, axis in enumerate(COMPONENTS[values.shape[1]])
        ]
    about(whole, unit, doc or DOCS.get(name, ""))
    for part in parts:
        describe(part, unitSI=1.0, unit=unit)


def packed(values: np.ndarray, level: int) -> dict:
    """How an array is stored: HDF5 cannot compress an empty one."""
    return PACKED | {"compression_opts": level} if len(values) and level else {}


def offset(cloud: h5py.Group, count: int) -> None:
    """The record positionOffset of `count` particles, which the standard asks for: zero."""
    whole = cloud.create_group("positionOffset")
    about(whole, "m", "")
    for axis in COMPONENTS[3]:
        part = whole.create_group(axis)
        describe(part, value=0.0, shape=np.array([count], np.uint64), unitSI=1.0, unit="m")


def about(whole: h5py.HLObject, unit: str, doc: str) -> None:
    powers = np.array(DIMENSIONS[unit] + (0, 0, 0, 0), float)
    describe(whole, {"unitDimension": powers, "timeOffset": 0.0} | ({"doc": doc} if doc else {}))


def history(file: h5py.File, rows: Mapping[str, tuple[np.ndarray, str, str]]) -> None:
    """The group /energy: values over time, each with unit and meaning, by name."""
    group = file.create_group("energy")
    for name, (values, unit, doc) in rows.items():
        group[name] = np.asarray(values, float)
        describe(group[name], unit=unit, doc=doc)
