"""LIGGGHTS as a library: commands in, arrays out.

One instance per process, in a child process (see process.py): LIGGGHTS ends its process on any
input error.
"""

import ctypes
import os
from pathlib import Path

import numpy as np

from cases.errors import EngineError

from .grains import Grains
from .moment import ARRAYS, PLAIN_COLUMNS, ROLLING_COLUMNS, VECTORS, Atoms, array
from .moment import library as ledger

LIBRARY = "libliggghts.so.3"


def load_library() -> ctypes.CDLL:
    """The shared library of Debian's liggghts package; EngineError when it is not installed."""
    try:
        ctypes.CDLL("libmpi.so.40", mode=ctypes.RTLD_GLOBAL)
        library = ctypes.CDLL(LIBRARY, mode=ctypes.RTLD_GLOBAL)
    except OSError as error:
        raise EngineError(
            f"LIGGGHTS: {LIBRARY} cannot be loaded ({error}) install the packages liggghts and "
            "libopenmpi3"
        ) from None
    library.lammps_extract_atom.restype = ctypes.c_void_p
    library.lammps_extract_compute.restype = ctypes.c_void_p
    library.lammps_extract_global.restype = ctypes.c_void_p
    return library


class Liggghts:
    """One LIGGGHTS simulation in this process; `log` is the file of its own words.

    The process works in the log's folder from here on: in its commands LIGGGHTS knows no way to
    write every name that a folder may have, so files are named without their folder.
    """

    def __init__(self, log: Path, grains: Grains | None = None):
        """grains: what its contacts hold, and whether its grains are told their sizes, follows
        them; none: equal ones without rolling resistance.
        """
        self.library = load_library()
        self.columns = ROLLING_COLUMNS if grains and grains.rolls else PLAIN_COLUMNS
        self.sized = grains is not None and not grains.even
        os.chdir(log.parent)
        # The screen may not be `none`: insert/pack writes to it without asking. The log carries
        # the errors.
        words = [b"liggghts", b"-screen", b"/dev/null", b"-log", log.name.encode()]
        self._instance = ctypes.c_void_p()
        self._open(len(words), (ctypes.c_char_p * len(words))(*words))

    def _open(self, count: int, words: ctypes.Array) -> None:
        self.library.lammps_open_no_mpi(count, words, ctypes.byref(self._instance))

    def command(self, line: str) -> None:
        self.library.lammps_command(self._instance, line.encode())

    def commands(self, text: str) -> None:
        """Every line of an input script; `&` continues a line, `#` starts a comment."""
        for line in text.replace("&\n", " ").splitlines():
            line = line.split("#")[0].strip()
            if line:
                self.command(line)

    def create(self, centres: np.ndarray, kind: int = 1) -> None:
        """Puts grains of type `kind` at `centres`, (n, 3) [m]."""
        for x, y, z in centres:
            self.command(f"create_atoms {kind} single {x:.17g} {y:.17g} {z:.17g} units box")

    def advance(self, steps: int) -> None:
        """Further steps without a new set-up: how a run is cut into pieces does not change it."""
        self.command(f"run {steps} pre no post no")

    def reach(self, step: int) -> int:
        """The same to the end of a step, which may be reached already; the step."""
        if step > self.step():
            self.advance(step - self.step())
        return step

    def close(self) -> None:
        self.library.lammps_close(self._instance)

    def count(self) -> int:
        """Number of grains, glued ones included."""
        return self.library.lammps_get_natoms(self._instance)

    def here(self) -> int:
        """Of them, those of this process."""
        return self._told("nlocal", ctypes.c_int32).value

    def atoms(self) -> dict[str, np.ndarray]:
        """Copies of what the grains carry now, in the engine's order.

        x, v, f, omega, torque: (n, 3) [m, m/s, N, 1/s, N m]; id, type: (n,) integers; of grains of
        several sizes radius (n,) [m].
        """
        out = {name: self.vectors(name).copy() for name in VECTORS}
        out |= {name: self.integers(name).copy() for name in ("id", "type")}
        return out | ({"radius": self.scalars("radius").copy()} if self.sized else {})

    def vectors(self, name: str) -> np.ndarray:
        """The engine's own x, v, f, omega or torque of every grain, (n, 3), to read or to set.

        A view in the engine's order, valid until the next command.
        """
        address = self.library.lammps_extract_atom(self._instance, name.encode())
        return _table(address, self.here(), 3)

    def integers(self, name: str) -> np.ndarray:
        """Its own id or type of every grain (n,): a view, as `vectors`."""
        address = self.library.lammps_extract_atom(self._instance, name.encode())
        return array(address, np.int32, self.here())

    def scalars(self, name: str) -> np.ndarray:
        """Its own radius [m] or rmass [kg] of every grain (n,): a view, as `vectors`."""
        address = self.library.lammps_extract_atom(self._instance, name.encode())
        return array(address, np.float64, self.here())

    def resize(self, ids: np.ndarray, diameters: np.ndarray, density: float) -> None:
        """Gives the grains of `ids` (n,) their `diameters` (n,) [m] and masses; the next set-up
        takes them up.
        """
        own = self.integers("id")
        place = np.zeros(own.max() + 1, int)
        place[own] = np.arange(own.size)
        self.scalars("radius")[place[ids]] = diameters / 2
        self.scalars("rmass")[place[ids]] = density * np.pi / 6 * diameters**3

    def scalar(self, compute: str) -> float:
        """Value of a global compute at this instant."""
        pointer = self.library.lammps_extract_compute(self._instance, compute.encode(), 0, 0)
        return ctypes.c_double.from_address(pointer).value

    def per_atom(self, compute: str, columns: int) -> np.ndarray:
        """A per-atom compute at this instant, (n, columns): a view, as `vectors`."""
        address = self.library.lammps_extract_compute(self._instance, compute.encode(), 1, 2)
        return _table(address, self.here(), columns)

    def extent(self, name: str) -> float:
        """A coordinate of the simulation box, such as boxxhi [m]."""
        return self._told(name, ctypes.c_double).value

    def bounds(self) -> np.ndarray:
        """Of the simulation box: lower and upper of x, y, z (6,) [m]."""
        names = [f"box{axis}{side}" for axis in "xyz" for side in ("lo", "hi")]
        return np.array([self.extent(name) for name in names])

    def step(self) -> int:
        """Number of the last step."""
        return self._told("ntimestep", ctypes.c_int64).value

    def has_listed(self) -> bool:
        """Whether the last step has made the list of neighbours anew."""
        return self.listed_ago() == 0

    def listed_ago(self) -> int:
        """How many steps ago that was."""
        return self._told("ago", ctypes.c_int32).value

    def _told(self, name: str, kind):
        address = self.library.lammps_extract_global(self._instance, name.encode())
        return kind.from_address(address)

    def held(self) -> Atoms:
        """Where the engine holds its grains; valid until the next command."""
        pointers = {
            name: self.library.lammps_extract_atom(self._instance, name.encode()) for name in ARRAYS
        }
        rows = {name: _first_row(pointers[name]) for name in VECTORS}
        n, radius = self.here(), None
        if self.sized:
            radius = self.library.lammps_extract_atom(self._instance, b"radius")
        return Atoms(n, n, *(pointers | rows).values(), radius)

    def held_contacts(self) -> tuple[int | None, int]:
        """Where the engine holds its grain-grain contacts, and how many: rows as of `contacts`,
        valid until the next command. The library does not tell their number, but the sum of the
        first ids.
        """
        total = self.scalar("id_sum")
        if total == 0:
            return None, 0
        address = self.library.lammps_extract_compute(self._instance, b"pairs", 2, 2)
        first = _first_row(address)
        return first, ledger().contact_count(first, total, self.columns)

    def contacts(self) -> np.ndarray:
        """Every grain-grain contact, (n, 7): first and second id, periodic flag, spring s (3) and
        overlap; with rolling resistance (n, 10), its spring's torque before the overlap.
        """
        address, count = self.held_contacts()
        return array(address, np.float64, count, self.columns).copy()


def _first_row(address: int) -> int:
    """Where the rows of a double** of the engine's begin; they lie one behind the other."""
    return ctypes.c_void_p.from_address(address).value or 0


def _table(address: int, rows: int, columns: int) -> np.ndarray:
    """The engine's double** as an array on its memory."""
    return array(_first_row(address), np.float64, rows, columns)
