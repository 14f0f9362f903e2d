"""The work of gravity along the slope of a chute, which is all that drives it."""

import numpy as np

from cases.scenes import gravity_of, is_chute

from .grains import Grains
from .moment import Atoms, array
from .scene import TYPES


class Drive:
    """The work of gravity along the slope on the moving grains, from their way since the release.

    With the velocity Verlet scheme a constant force does exactly that work in every step. Between
    two looks no grain may go half a period: a row of the energy history is far shorter.
    """

    def __init__(self, case: dict, grains: Grains):
        self.length = case["geometry"]["length"]
        self.grains, self.pull = grains, gravity_of(case["geometry"])[0]  # [m/s2]
        self.work = 0.0  # [J]
        self.places = np.empty(0)  # x of the moving grains in the order of their ids [m]

    def look(self, atoms: Atoms) -> float:
        """The work so far [J], from all grains."""
        count = atoms.owned
        x = array(atoms.x, np.float64, count, 3)[:, 0]
        mobile = array(atoms.type, np.int32, count) == TYPES["grain"]
        ids = array(atoms.id, np.int32, count)[mobile]
        order = np.argsort(ids)
        places = x[mobile][order]
        if self.places.size:
            way = places - self.places
            way -= self.length * np.rint(way / self.length)
            if self.grains.even:
                self.work += self.pull * self.grains.mass * float(way.sum())
            else:
                radius = array(atoms.radius, np.float64, count)[mobile][order]
                masses = self.grains.density * np.pi * 4.0 / 3.0 * radius**3
                self.work += self.pull * float(masses @ way)
        self.places = places
        return self.work

    def state(self) -> dict[str, np.ndarray]:
        return {"driven": np.array(self.work), "places": self.places.copy()}

    def take_up(self, kept: dict[str, np.ndarray]) -> None:
        self.work, self.places = float(kept["driven"]), kept["places"]


def drive_of(case: dict, grains: Grains) -> Drive | None:
    """None of a collapse."""
    return Drive(case, grains) if is_chute(case["geometry"]) else None
