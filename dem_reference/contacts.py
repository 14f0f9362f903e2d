"""Every contact of a moment with its force, copied from what the library rebuilds (moment.py)."""

from dataclasses import dataclass

import numpy as np

from .grains import Grains
from .moment import ARRAYS, PAIR, TOUCH, Moment, atoms_of, planes_of
from .scene import TYPES, Plane


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("ij,ij->i", a, b)


@dataclass
class Snapshot:
    """State of all grains at one time and their contacts, as the engine holds them.

    atoms: see Liggghts.atoms; rows: see Liggghts.contacts.
    """

    grains: Grains
    atoms: dict
    rows: np.ndarray
    dt: float  # [s]
    gravity: float  # along -y [m/s2]
    thickness: float | None  # periodic length along z [m]
    planes: list[Plane]  # the walls that stand at this time
    length: float | None = None  # periodic length along x [m]
    pull: float = 0.0  # gravity along x [m/s2]

    def __post_init__(self):
        self.mobile = self.atoms["type"] == TYPES["grain"]
        self.moment = Moment(
            self.grains, self.dt, self.gravity, self.thickness, self.length, self.pull
        )
        self._arrays = {
            name: np.ascontiguousarray(self.atoms[name], kind) for name, kind in ARRAYS.items()
        }
        rows = np.ascontiguousarray(self.rows, float)
        walls = planes_of(self.planes)
        self.moment.look(atoms_of(self._arrays), rows.ctypes.data, len(rows), walls)
        self.held = self.moment.held
        self._pairs(self.moment.pairs)
        self.wall = WallContacts(self.moment.touches)

    def _pairs(self, pairs: np.ndarray) -> None:
        assert pairs.dtype == PAIR
        self.i, self.j = pairs["first"], pairs["second"]
        self.branch, self.normal = pairs["branch"], pairs["normal"]
        self.overlap, self.arm = pairs["overlap"], pairs["arm"][:, None]
        self.force = pairs["force"]  # on the first grain, from the second
        self.elastic_parts = pairs["elastic"]  # U_n and U_t of each contact (n, 2) [J]
        self.power_parts = pairs["power"]  # P_n and P_t of each contact (n, 2) [W]
        # -F_n u_n and -F_t . u_t of each contact (n, 2) [W]: taken from its grains' motion
        self.work_rate_parts = pairs["work_rate"]


class WallContacts:
    """Contacts with walls: which grain, its wall's code, what acts on it."""

    def __init__(self, touches: np.ndarray):
        assert touches.dtype == TOUCH
        self.grain, self.code, self.normal = (touches[k] for k in ("grain", "code", "normal"))
        self.branch = touches["branch"]  # grain's centre - contact point
        self.force, self.power = touches["force"], touches["power"]
