"""Contacts across the borders of a scene whose grains are shared among ranks.

LIGGGHTS holds each grain on one rank, and lists a contact of two grains that are not on one rank
once: on that of the higher id. The ledger looks at all contacts of a rank's grains, and needs of
the grain beyond what only its owner has: force and torque, and velocities of now, where the engine
keeps those that the force was evaluated with. So at each look the lister hands contact and grain to
the other rank, and gets the other grain back.
"""

import ctypes
from pathlib import Path

import numpy as np

from .engine import Liggghts
from .grains import Grains
from .moment import VECTORS, array
from .scene import TYPES
from .world import World

SOON = 0.9  # of the time between the last two lists

_c = ctypes.CDLL(None)
_c.malloc_usable_size.argtypes, _c.malloc_usable_size.restype = [ctypes.c_void_p], ctypes.c_size_t


class SharedLiggghts(Liggghts):
    """One simulation on all ranks; each sees the grains that it holds, and lists their contacts."""

    def __init__(self, log: Path, grains: Grains, world: World):
        self.world, self.grains = world, grains
        self.disturbed = True  # by other commands than steps, since that was asked last
        self._block = (0, 0)  # address and size of the rows of contacts [bytes]
        self._lists = 0  # of contacts, so far
        super().__init__(log, grains)

    def _open(self, count: int, words: ctypes.Array) -> None:
        every = ctypes.c_void_p.from_address(self.world.mpi._addressof(self.world.all))
        self.library.lammps_open(count, words, every, ctypes.byref(self._instance))

    def commands(self, text: str) -> None:
        self.disturbed = True
        super().commands(text)

    def ghosts(self) -> int:
        """Number of grains that the engine shows this rank of its neighbours', or across a period,
        each as often as it lies near.
        """
        return self._told("nghost", ctypes.c_int32).value

    def touches_at_all(self) -> bool:
        """Whether two of this rank's grains touch, as far as cells of a diameter show: then the
        engine has memory for contacts here. Where it never had a contact, it tells nonsense of that
        and `held_contacts` must not ask.
        """
        d, x = self.grains.largest, self.vectors("x")
        radius = self.scalars("radius")
        cell = np.floor(x / d)
        order = np.lexsort(cell.T)
        x, radius, cell = x[order], radius[order], cell[order]
        apart = np.linalg.norm(x[1:] - x[:-1], axis=1)
        moves = self.integers("type")[order] == TYPES["grain"]
        met = (apart < radius[1:] + radius[:-1]) & moves[1:]
        return bool(met.any())

    def held_contacts(self) -> tuple[int | None, int]:
        """As of an engine alone; of contacts across a border those that this rank lists.

        How many they are nobody tells: the engine adds ids up over all ranks. So the first id of
        every row that it has memory for is overwritten before it lists, and its rows end where that
        shows. Where it has taken new memory, which holds anything, it lists once more.
        """
        if self._block[0]:
            self._ids()[:] = 0.0
        found = self._list()
        while found != self._block:
            self._block = found
            if found[0]:
                self._ids()[:] = 0.0
                found = self._list()
        if not found[0]:
            return None, 0
        ids = self._ids()
        ends = np.flatnonzero(ids == 0.0)
        return found[0], int(ends[0]) if ends.size else ids.size

    def seen(self) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """As of `atoms` and `contacts`, but where the engine holds them: valid until it goes on."""
        atoms = {name: self.vectors(name) for name in VECTORS}
        atoms |= {name: self.integers(name) for name in ("id", "type")}
        address, count = self.held_contacts()
        rows = array(address, np.float64, count, self.columns)
        return atoms | ({"radius": self.scalars("radius")} if self.sized else {}), rows

    def _ids(self) -> np.ndarray:
        """The first ids of all rows there is memory for: a view."""
        address, size = self._block
        rows = size // (8 * self.columns)
        return array(address, np.float64, rows, self.columns)[:, 0]

    def _list(self) -> tuple[int, int]:
        """Has the engine list contacts; where it does, and in how much memory."""
        step = self._told("ntimestep", ctypes.c_int64)
        now, self._lists = step.value, self._lists + 1
        step.value = -1 - self._lists  # or it may take its last list to be of now; -1 is none
        rows = self.library.lammps_extract_compute(self._instance, b"pairs", 2, 2)
        step.value = now
        first = (ctypes.c_void_p.from_address(rows).value or 0) if rows else 0
        return first, _c.malloc_usable_size(first) if first else 0


class Border:
    """Who owns which grain, and the contacts of a rank's grains with those of others."""

    def __init__(self, engine: SharedLiggghts):
        self.engine, self.world = engine, engine.world
        self.owners = np.empty(0, np.int32)  # by id: its rank, -1 where there is no such grain
        self.version = 0  # how often grains may have changed hands
        self.step, self.ago = 0, 0  # of the last look; the list's age then
        self.period = 0  # of the last two lists that a look has seen [steps]
        self._place = np.empty(0, np.int64)  # of this rank's grains in its arrays, by id

    def follow(self) -> None:
        """Learns who owns which grain, where that may have changed: when neighbours are listed."""
        engine = self.engine
        step, ago = engine.step(), engine.listed_ago()
        kept = ago == self.ago + step - self.step and not engine.disturbed
        if ago != self.ago + step - self.step:
            self.period = (step - ago) - (self.step - self.ago)
        self.step, self.ago, engine.disturbed = step, ago, False
        if kept:
            return
        own = engine.integers("id")
        ids, counts = self.world.everywhere(own)
        self.owners = np.full(int(ids.max()) + 1, -1, np.int32)
        self.owners[ids] = np.repeat(np.arange(self.world.size, dtype=np.int32), counts)
        self._place = np.full(self.owners.size, -1)
        self._place[own] = np.arange(own.size)
        self.version += 1

    def next_listing(self) -> int:
        """The step at which the next list will be made at the earliest, as a rule: grains move as
        fast as they did.
        """
        return self.step - self.ago + int(SOON * self.period)

    def look(self) -> tuple[dict[str, np.ndarray], int, np.ndarray]:
        """This rank's grains, and behind them those of others that touch them, as of
        Liggghts.atoms; how many are its own; and all contacts of its own, as of Liggghts.contacts.
        """
        self.follow()
        atoms, rows = self.engine.seen()
        first, second = rows[:, :2].astype(np.int64).T
        to = self.owners[second]
        abroad = np.flatnonzero(to != self.world.rank)
        abroad = abroad[np.argsort(to[abroad], kind="stable")]
        sent = np.hstack([rows[abroad], states(atoms, self._place[first[abroad]])])
        going, coming = self.world.counts(to[abroad])
        got = self.world.swap(sent, going, coming)
        listed, theirs = got[:, : rows.shape[1]], got[:, rows.shape[1] :]
        asked = states(atoms, self._place[listed[:, 1].astype(np.int64)])
        others = np.vstack([theirs, self.world.swap(asked, coming, going)])
        _, once = np.unique(others[:, 0], return_index=True)
        return with_states(atoms, others[once]), len(atoms["id"]), np.vstack([rows, listed])


def states(atoms: dict[str, np.ndarray], places: np.ndarray) -> np.ndarray:
    """Of grains at `places` (n,) id, type, vectors, and radius where atoms have it, as rows (n, 17)
    or (n, 18).
    """
    singles = [atoms[name][places, None] for name in ("id", "type")]
    sizes = [atoms["radius"][places, None]] if "radius" in atoms else []
    return np.hstack([*singles, *(atoms[name][places] for name in VECTORS), *sizes])


def with_states(atoms: dict[str, np.ndarray], more: np.ndarray) -> dict[str, np.ndarray]:
    """The same atoms, and behind them what `states` has told of others."""
    columns = {"id": more[:, 0], "type": more[:, 1]}
    columns |= {name: more[:, 2 + 3 * k : 5 + 3 * k] for k, name in enumerate(VECTORS)}
    if "radius" in atoms:
        columns["radius"] = more[:, 17]
    return {
        name: np.concatenate([values, columns[name].astype(values.dtype)])
        for name, values in atoms.items()
    }
