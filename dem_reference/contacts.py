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
        if "radius" in self.atoms:
            self._arrays["radius"] = np.ascontiguousarray(self.atoms["radius"])
        rows = np.ascontiguousarray(self.rows, float)
        walls = planes_of(self.planes)
        self.moment.look(atoms_of(self._arrays), rows.ctypes.data, len(rows), walls)
        self.held = self.moment.held
        self._pairs(self.moment.pairs)
        self.wall = WallContacts(self.moment.touches)

    @property
    def radius(self) -> np.ndarray | float:
        """Of each grain (n,), or of all [m]."""
        return self.atoms.get("radius", self.grains.radius)

    @property
    def volume(self) -> np.ndarray:
        """Of each grain (n,) [m3]."""
        if "radius" not in self.atoms:
            return np.full(self.mobile.size, self.grains.volume)
        return 4 / 3 * np.pi * self.atoms["radius"] ** 3

    def of_mobile(self, values: np.ndarray | float) -> np.ndarray | float:
        """Those of the moving grains, of what each has or all have."""
        return values[self.mobile] if isinstance(values, np.ndarray) else values

    def _pairs(self, pairs: np.ndarray) -> None:
        assert pairs.dtype == PAIR
        self.i, self.j = pairs["first"], pairs["second"]
        self.branch, self.normal = pairs["branch"], pairs["normal"]
        self.overlap, self.arm = pairs["overlap"], pairs["arm"][:, None]
        self.force = pairs["force"]  # on the first grain, from the second
        self.torque = pairs["torque"]  # of rolling resistance, on the first grain
        self.elastic_parts = pairs["elastic"]  # U_n, U_t and U_r of each contact (n, 3) [J]
        self.power_parts = pairs["power"]  # P_n, P_t and P_r of each contact (n, 3) [W]
        # -F_n u_n, -F_t . u_t, M . w of each contact (n, 3) [W]: taken from its grains' motion
        self.work_rate_parts = pairs["work_rate"]


class WallContacts:
    """Contacts with walls: which grain, its wall's code, what acts on it."""

    def __init__(self, touches: np.ndarray):
        assert touches.dtype == TOUCH
        self.grain, self.code, self.normal = (touches[k] for k in ("grain", "code", "normal"))
        self.branch = touches["branch"]  # grain's centre - contact point
        self.force, self.power = touches["force"], touches["power"]
