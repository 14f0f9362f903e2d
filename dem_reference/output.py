"""dem.h5: openPMD layout of CONTRIBUTING.md, written frame by frame.

Beside its target, and renamed when complete.

Size: positions are stored as doubles (an overlap is 1e-3 of a grain and must survive), and so is
what a grain has dissipated (to be summed and compared with the history); velocities and spins as
floats; ids, mass, radius and volume compress to almost nothing; about 50 bytes per grain and frame,
and about 45 per contact.
"""

from functools import partial
from pathlib import Path

import h5py
import numpy as np

from cases import openpmd

from .audit import DOCS, Audit
from .contacts import Snapshot
from .scene import TYPES


class Result:
    """An HDF5 result file under construction at `path`; a block that has it open closes it."""

    def __init__(self, path: Path, attributes: dict):
        self.file = openpmd.create(path, "dem", attributes)

    def __enter__(self) -> "Result":
        return self

    def __exit__(self, *_) -> None:
        self.file.close()

    def frame(
        self,
        step: int,
        time: float,
        shot: Snapshot,
        contacts: bool,
        dissipated: np.ndarray | None = None,
    ) -> None:
        """All grains, and their contacts if asked, at one time; dissipated: of each grain [J], in
        the order of shot.atoms, where it is known. The file can be read up to here if the process
        is killed later.
        """
        group = openpmd.frame(self.file, step, time, shot.dt)
        cloud = group.create_group("particles/cloud")
        order = np.argsort(shot.atoms["id"])
        a, g = {name: values[order] for name, values in shot.atoms.items()}, shot.grains
        ones = np.ones(order.size)
        volume = shot.volume[order]
        record = partial(openpmd.record, cloud)
        record("position", a["x"], "m", np.float64)
        openpmd.offset(cloud, order.size)
        record("velocity", a["v"], "m/s", np.float32)
        record("angular_velocity", a["omega"], "1/s", np.float32)
        record("id", a["id"], "-", np.uint64)
        record("kind", np.where(a["type"] == TYPES["grain"], 1, 3), "-", np.int8)
        record("mass", g.mass * ones if g.even else g.density * volume, "kg", np.float64)
        record("solid_volume", volume, "m3", np.float64)
        record("radius", a.get("radius", g.radius * ones), "m", np.float64)
        if dissipated is not None:
            record("dissipated", dissipated[order], "J", np.float64)
        if contacts:
            self._contacts(group.create_group("contacts"), shot)
        self.file.flush()

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
            openpmd.record(group, name, values, unit, kind)

    def history(self, rows: dict) -> None:
        """The energies over time, one dataset per name of audit.DOCS."""
        told = {name: (np.array(values), *DOCS[name]) for name, values in rows.items()}
        openpmd.history(self.file, told)

    def lifetimes(self, audit: Audit) -> None:
        """The split of the dissipation by contact lifetime."""
        lifetimes = audit.accounts.lifetimes()
        group = self.file.create_group("lifetime")
        openpmd.describe(
            group,
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
            "dissipated_rolling": (
                lifetimes.heat[:, 2],
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
        if "dissipated_rolling" in audit.absent:
            del columns["dissipated_rolling"]
        for name, (values, unit, doc) in columns.items():
            group[name] = values
            openpmd.describe(group[name], unit=unit, doc=doc)

    def checks(self, shot: Snapshot, force_error: float, torque_error: float) -> None:
        """What tells of grains and audit: errors of force [N] and, where grains resist rolling, of
        torque [N m]; of grains of several sizes the diameter that maps call theirs [m].
        """
        openpmd.describe(self.file, force_error=force_error)
        if shot.grains.rolls:
            openpmd.describe(self.file, torque_error=torque_error)
        if not shot.grains.even:
            radius = shot.atoms["radius"][shot.mobile]
            d43 = 2 * float((radius**4).sum() / (radius**3).sum())
            openpmd.describe(self.file, diameter=d43)

    def packing(self, path: Path) -> None:
        """The packing's own description, copied."""
        with h5py.File(path) as source:
            group = self.file.create_group("packing")
            openpmd.describe(group, dict(source.attrs))
            for name in source:
                source.copy(name, group)
                openpmd.describe(group[name], dict(source[name].attrs))
