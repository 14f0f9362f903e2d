"""The file that imported grains are kept in: a run file of the grains (CONTRIBUTING.md), without a
case where nobody gave one.

It is written frame by frame. What is drawn from few values (ids, radii, masses) is compressed,
places and velocities are not: deflating them takes longer than all the rest.
"""

from pathlib import Path

import numpy as np

from cases import openpmd
from cases.case import Case
from compare.importing import energies
from compare.importing.contacts import Contacts
from compare.importing.frame import Box
from compare.mapping.clouds import GLUED

UNITS = {
    "position": "m",
    "velocity": "m/s",
    "angular_velocity": "1/s",
    "mass": "kg",
    "solid_volume": "m3",
    "radius": "m",
    "branch": "m",
    "force": "N",
    "dissipation": "W",
}
LEVEL = 1  # of compression


class GrainsFile:
    """A file under construction at `path`, SI and our axes."""

    def __init__(self, path: Path):
        unknown = dict.fromkeys(("cpu_seconds", "cpu_seconds_engine", "wall_seconds"), np.nan)
        told = {"seed": -1, "threads": 1, "end_reason": "maximum", **unknown}
        self.file = openpmd.create(path, "dem", told)

    def describe(self, **attributes):
        """Attributes of the root."""
        openpmd.describe(self.file, attributes)

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
        group = openpmd.frame(self.file, step, time, dt)
        none = np.full(3, np.nan)
        openpmd.describe(
            group,
            box_lower=none if box is None else box.lower,
            box_upper=none if box is None else box.upper,
        )
        cloud = group.create_group("particles/cloud")
        for name, values in vectors.items():
            openpmd.record(cloud, name, values, UNITS[name], values.dtype, level=0)
        openpmd.offset(cloud, len(ids))
        kind = np.where(wall, GLUED, 1).astype(np.int8)
        columns: dict[str, np.ndarray] = {"id": ids.astype(np.uint64), "kind": kind, **scalars}
        for name, values in columns.items():
            level = LEVEL if is_worth_it(values) else 0
            openpmd.record(cloud, name, values, UNITS.get(name, "-"), values.dtype, level=level)

    def contacts(self, step: int, contacts: Contacts):
        """Those of a frame that is there."""
        group = self.file.create_group(f"data/{step}/contacts")
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
            unit = "m" if name == "position" else UNITS.get(name, "-")
            level = LEVEL if name in ("first", "second") else 0
            openpmd.record(group, name, values, unit, values.dtype, level=level)

    def history(self, rows: dict[str, np.ndarray]):
        """The energy history."""
        openpmd.history(
            self.file,
            {
                name: (values, "s" if name == "time" else "J", energies.DOCS[name])
                for name, values in rows.items()
            },
        )

    def close(self):
        self.file.close()


def is_worth_it(values: np.ndarray) -> bool:
    """Whether a column deflates well: whole numbers, or few different values."""
    some = values[:: max(1, len(values) // 1000)]
    return values.dtype.kind != "f" or len(np.unique(some)) < len(some) / 10
