"""dem.h5: openPMD layout of CONTRIBUTING.md, written frame by frame.

Beside its target, and renamed when complete.

Size: positions are stored as doubles (an overlap is 1e-3 of a grain and must survive), and so is
what a grain has dissipated (to be summed and compared with the history); velocities and spins as
floats; ids, mass, radius and volume compress to almost nothing; about 50 bytes per grain and frame,
and about 45 per contact.
"""

import datetime
import platform
from pathlib import Path

import h5py
import numpy as np

from cases.provenance import commit

from .audit import DOCS, Audit
from .contacts import Snapshot
from .scene import TYPES

# Powers of length, mass, time, current, temperature, amount, light, as openPMD wants them.
DIMENSIONS = {
    "m": (1, 0, 0),
    "m/s": (1, 0, -1),
    "kg": (0, 1, 0),
    "m3": (3, 0, 0),
    "1/s": (0, 0, -1),
    "N": (1, 1, -2),
    "J": (2, 1, -2),
    "W": (2, 1, -3),
    "-": (0, 0, 0),
}
PACKED = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
AXES = ("x", "y", "z")


class Result:
    """An HDF5 result file under construction at `path`."""

    def __init__(self, path: Path, attributes: dict):
        self.file = h5py.File(path, "w")
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
                "softwareVersion": "0.1.0",
                "schema_version": 1,
                "engine": "dem",
                "date": datetime.datetime.now(datetime.timezone.utc).strftime(
                    "%Y-%m-%d %H:%M:%S +0000"
                ),
                "machine": platform.node() or "unknown",
                "commit": commit(),
                **attributes,
            }
        )

    def frame(
        self,
        step: int,
        time: float,
        shot: Snapshot,
        contacts: bool,
        dissipated: np.ndarray | None = None,
    ) -> None:
        """All grains, and their contacts if asked, at one time; dissipated: of each grain [J], in
        the order of shot.atoms, where it is known.
        """
        group = self.file.create_group(f"data/{step}")
        group.attrs.update(time=time, dt=shot.dt, timeUnitSI=1.0)
        cloud = group.create_group("particles/cloud")
        order = np.argsort(shot.atoms["id"])
        a, g = {name: values[order] for name, values in shot.atoms.items()}, shot.grains
        ones = np.ones(order.size)
        self._record(cloud, "position", a["x"], "m", np.float64)
        self._record(cloud, "positionOffset", np.zeros((order.size, 3)), "m", np.float64)
        self._record(cloud, "velocity", a["v"], "m/s", np.float32)
        self._record(cloud, "angular_velocity", a["omega"], "1/s", np.float32)
        self._record(cloud, "id", a["id"], "-", np.int32)
        self._record(cloud, "kind", np.where(a["type"] == TYPES["grain"], 1, 3), "-", np.int8)
        self._record(cloud, "mass", g.mass * ones, "kg", np.float64)
        self._record(cloud, "solid_volume", g.volume * ones, "m3", np.float64)
        self._record(cloud, "radius", g.radius * ones, "m", np.float64)
        if dissipated is not None:
            self._record(cloud, "dissipated", dissipated[order], "J", np.float64)
        if contacts:
            self._contacts(group.create_group("contacts"), shot)

    def _contacts(self, group: h5py.Group, shot: Snapshot) -> None:
        ids, wall = shot.atoms["id"], shot.wall
        arm = shot.arm * shot.normal
        columns = {
            "first": (np.concatenate([ids[shot.i], ids[wall.grain]]), "-", np.int32),
            "second": (np.concatenate([ids[shot.j], wall.code]), "-", np.int32),
            "branch": (np.concatenate([shot.branch, wall.branch]), "m", np.float32),
            "position": (
                np.concatenate(
                    [shot.atoms["x"][shot.i] - arm, shot.atoms["x"][wall.grain] - wall.branch]
                ),
                "m",
                np.float32,
            ),
            "force": (np.concatenate([shot.force, wall.force]), "N", np.float32),
            "dissipation": (
                np.concatenate([shot.power_parts.sum(axis=1), wall.power]),
                "W",
                np.float32,
            ),
        }
        for name, (values, unit, kind) in columns.items():
            self._record(group, name, values, unit, kind)

    @staticmethod
    def _record(parent: h5py.Group, name: str, values: np.ndarray, unit: str, kind) -> None:
        if values.ndim == 1:
            record = parent.create_dataset(name, data=values.astype(kind), **PACKED)
            parts = [record]
        else:
            record = parent.create_group(name)
            parts = [
                record.create_dataset(axis, data=values[:, k].astype(kind), **PACKED)
                for k, axis in enumerate(AXES)
            ]
        record.attrs.update(
            unitDimension=np.array(DIMENSIONS[unit] + (0, 0, 0, 0), float), timeOffset=0.0
        )
        for part in parts:
            part.attrs.update(unitSI=1.0, unit=unit)

    def history(self, rows: dict) -> None:
        """The energies over time, one dataset per name of audit.DOCS."""
        group = self.file.create_group("energy")
        for name, values in rows.items():
            unit, doc = DOCS[name]
            group[name] = np.array(values)
            group[name].attrs.update(unit=unit, doc=doc)

    def lifetimes(self, audit: Audit) -> None:
        """The split of the dissipation by contact lifetime."""
        lifetimes = audit.accounts.lifetimes()
        group = self.file.create_group("lifetime")
        group.attrs.update(
            unit_time=audit.unit,
            interval=audit.interval,
            doc="lifetimes in binary contact times (unit_time [s]), resolved to the sampling "
            "interval [s]",
        )
        columns = {
            "edges": (
                lifetimes.edges,
                "-",
                "faces of the lifetime classes; the first is below the first face, the last above "
                "the last",
            ),
            "dissipated_normal": (
                lifetimes.heat[:, 0],
                "J",
                "by class, over the whole run",
            ),
            "dissipated_tangential": (
                lifetimes.heat[:, 1],
                "J",
                "by class, over the whole run",
            ),
            "contacts": (lifetimes.contacts, "-", "contacts of each class"),
            "multiples": (
                lifetimes.multiples,
                "-",
                "multiples of dem.lifetime_threshold used as threshold below",
            ),
            "dissipated_enduring": (np.array(audit.enduring), "J", "row of /energy x threshold"),
        }
        for name, (values, unit, doc) in columns.items():
            group[name] = values
            group[name].attrs.update(unit=unit, doc=doc)

    def packing(self, path: Path) -> None:
        """The packing's own description, copied."""
        with h5py.File(path) as source:
            group = self.file.create_group("packing")
            group.attrs.update(dict(source.attrs))
            for name in source:
                source.copy(name, group)
