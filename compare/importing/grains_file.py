"""The file that imported grains are kept in: a run file of the grains (CONTRIBUTING.md), without a
case where nobody gave one.

It is written frame by frame. What is drawn from few values (ids, radii, masses) is compressed,
places and velocities are not: deflating them takes longer than all the rest.
"""

import datetime
import platform
from pathlib import Path

import h5py
import numpy as np

from cases.case import Case
from cases.provenance import commit
from compare.importing import energies
from compare.importing.contacts import Contacts
from compare.importing.frame import Box
from compare.mapping.runs import GLUED

# Powers of length, mass and time of a record's unit.
POWERS = {
    "m": (1, 0, 0),
    "m/s": (1, 0, -1),
    "kg": (0, 1, 0),
    "m3": (3, 0, 0),
    "1/s": (0, 0, -1),
    "N": (1, 1, -2),
    "W": (2, 1, -3),
    "-": (0, 0, 0),
}
PACKED = {"compression": "gzip", "compression_opts": 1, "shuffle": True}


class GrainsFile:
    """A file under construction at `path`, SI and our axes."""

    def __init__(self, path: Path):
        self.file = h5py.File(path, "w", libver=("v110", "v110"))  # attributes above 64 kB too
        self.file.attrs.update(
            {
                "openPMD": "1.1.0",
                "openPMDextension": np.uint32(0),
                "basePath": "/data/%T/",
                "particlesPath": "particles/",
                "meshesPath": "meshes/",
                "iterationEncoding": "groupBased",
                "iterationFormat": "/data/%T/",
                "software": "grainpair",
                "softwareVersion": commit(),
                "date": datetime.datetime.now(datetime.timezone.utc).strftime(
                    "%Y-%m-%d %H:%M:%S +0000"
                ),
                "machine": platform.node() or "unknown",
                "schema_version": 1,
                "engine": "dem",
                "commit": commit(),
                "seed": -1,
                "threads": 1,
                "end_reason": "maximum",
            }
        )
        for name in ("cpu_seconds", "cpu_seconds_engine", "wall_seconds"):
            self.file.attrs[name] = np.nan

    def describe(self, **attributes):
        """Attributes of the root."""
        self.file.attrs.update(attributes)

    def scene(self, scene: Case):
        """The case that the grains are of."""
        scale = float(np.sqrt(scene["geometry.height"] / scene["geometry.gravity"]))
        self.describe(case=scene.text, case_resolved=scene.resolved, time_scale=scale)

    def frame(
        self,
        step: int,
        time: float,
        dt: float,
        box: Box | None,
        ids: np.ndarray,
        wall: np.ndarray,
        vectors: dict[str, np.ndarray],
        scalars: dict[str, np.ndarray],
    ):
        """One instant: vectors (N, 3) and scalars (N,) by their records' names; `wall` (N,), which
        grains are wall.
        """
        group = self.file.create_group(f"data/{step}")
        group.attrs.update({"time": time, "dt": dt, "timeUnitSI": 1.0})
        none = np.full(3, np.nan)
        group.attrs["box_lower"] = none if box is None else box.lower
        group.attrs["box_upper"] = none if box is None else box.upper
        cloud = group.create_group("particles/cloud")
        units = {"position": "m", "velocity": "m/s", "angular_velocity": "1/s"}
        for name, values in vectors.items():
            record(cloud, name, values, units[name])
        offset = cloud.create_group("positionOffset")
        about(offset, "m")
        for axis in "xyz":
            offset.create_group(axis).attrs.update(
                {"value": 0.0, "shape": np.array([len(ids)], np.uint64), "unitSI": 1.0, "unit": "m"}
            )
        kind = np.where(wall, GLUED, 1).astype(np.int8)
        units = {"mass": "kg", "solid_volume": "m3", "radius": "m"}
        for name, values in ({"id": ids, "kind": kind} | scalars).items():
            packed = PACKED if is_worth_it(values) else {}
            record(cloud, name, values, units.get(name, "-"), **packed)

    def contacts(self, step: int, contacts: Contacts):
        """Those of a frame that is there."""
        group = self.file.create_group(f"data/{step}/contacts")
        units = {"branch": "m", "position": "m", "force": "N", "dissipation": "W"}
        told = {
            "first": contacts.first,
            "second": contacts.second,
            "branch": contacts.branch,
            "position": contacts.point,
            "force": contacts.force,
        }
        if contacts.power is not None:
            told["dissipation"] = contacts.power
        for name, values in told.items():
            packed = PACKED if name in ("first", "second") and len(values) else {}
            record(group, name, values, units.get(name, "-"), **packed)

    def history(self, rows: dict[str, np.ndarray]):
        """The energy history."""
        for name, values in rows.items():
            data = self.file.create_dataset(f"energy/{name}", data=values)
            data.attrs.update({"unit": "s" if name == "time" else "J", "doc": energies.DOCS[name]})

    def close(self):
        self.file.close()


def record(parent: h5py.Group, name: str, values: np.ndarray, unit: str, **packed):
    """A record of values (N,) or (N, 3)."""
    if values.ndim == 1:
        whole = parts = [parent.create_dataset(name, data=values, **packed)]
        about(whole[0], unit)
    else:
        group = parent.create_group(name)
        about(group, unit)
        parts = [
            group.create_dataset(axis, data=np.ascontiguousarray(values[:, k]), **packed)
            for k, axis in enumerate("xyz")
        ]
    for part in parts:
        part.attrs.update({"unitSI": 1.0, "unit": unit})


def is_worth_it(values: np.ndarray) -> bool:
    """Whether a column deflates well: whole numbers, or few different values."""
    some = values[:: max(1, len(values) // 1000)]
    return values.dtype.kind != "f" or len(np.unique(some)) < len(some) / 10


def about(thing: h5py.HLObject, unit: str):
    thing.attrs["unitDimension"] = np.array(POWERS[unit] + (0, 0, 0, 0), dtype=float)
    thing.attrs["timeOffset"] = 0.0
