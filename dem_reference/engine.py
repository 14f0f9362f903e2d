"""LIGGGHTS as a library: commands in, arrays out. One instance per process, which LIGGGHTS ends on any input error."""

import ctypes
from pathlib import Path

import numpy as np

from cases.errors import EngineError


LIBRARY = "libliggghts.so.3"
CONTACT_COLUMNS = 7  # of `compute pairs`, see scripts/bodies.in


def load_library() -> ctypes.CDLL:
    """The shared library of Debian's liggghts package; EngineError when it is not installed."""
    try:
        ctypes.CDLL("libmpi.so.40", mode=ctypes.RTLD_GLOBAL)
        return ctypes.CDLL(LIBRARY, mode=ctypes.RTLD_GLOBAL)
    except OSError as error:
        raise EngineError(
            f"LIGGGHTS: {LIBRARY} cannot be loaded ({error}) install the packages liggghts and "
            "libopenmpi3"
        ) from None


class Liggghts:
    """One LIGGGHTS simulation in this process."""

    def __init__(self, log: Path):
        self.library = load_library()
        self.library.lammps_extract_atom.restype = ctypes.c_void_p
        self.library.lammps_extract_compute.restype = ctypes.c_void_p
        # The screen may not be `none`: insert/pack writes to it without asking. The log carries the errors.
        words = [b"liggghts", b"-screen", b"/dev/null", b"-log", str(log).encode()]
        self._instance = ctypes.c_void_p()
        self.library.lammps_open_no_mpi(
            len(words), (ctypes.c_char_p * len(words))(*words), ctypes.byref(self._instance)
        )

    def command(self, line: str) -> None:
        self.library.lammps_command(self._instance, line.encode())

    def commands(self, text: str) -> None:
        """Every line of an input script; `&` continues a line, `#` starts a comment."""
        for line in text.replace("&\n", " ").splitlines():
            line = line.split("#")[0].strip()
            if line:
                self.command(line)

    def advance(self, steps: int) -> None:
        """Further steps without a new set-up, so that how a run is cut into pieces does not change it."""
        self.command(f"run {steps} pre no post no")

    def close(self) -> None:
        self.library.lammps_close(self._instance)

    def count(self) -> int:
        """Number of grains, glued ones included."""
        return self.library.lammps_get_natoms(self._instance)

    def atoms(self) -> dict[str, np.ndarray]:
        """Copies of what the grains carry now, in the engine's order.

        x, v, f, omega, torque: (n, 3) [m, m/s, N, 1/s, N m]; id, type: (n,) integers.
        """
        n = self.count()
        out = {name: self._vectors(name, n) for name in ("x", "v", "f", "omega", "torque")}
        for name in ("id", "type"):
            pointer = self.library.lammps_extract_atom(self._instance, name.encode())
            out[name] = np.ctypeslib.as_array((ctypes.c_int * n).from_address(pointer)).copy()
        return out

    def set_velocities(self, v: np.ndarray) -> None:
        """Overwrites the velocities (n, 3) [m/s], in the engine's order."""
        self._view("v", len(v))[:] = v

    def _vectors(self, name: str, n: int) -> np.ndarray:
        return self._view(name, n).copy()

    def _view(self, name: str, n: int) -> np.ndarray:
        pointer = self.library.lammps_extract_atom(self._instance, name.encode())
        first_row = ctypes.c_void_p.from_address(pointer).value
        return np.ctypeslib.as_array((ctypes.c_double * (3 * n)).from_address(first_row)).reshape(
            n, 3
        )

    def scalar(self, compute: str) -> float:
        """Value of a global compute."""
        pointer = self.library.lammps_extract_compute(self._instance, compute.encode(), 0, 0)
        return ctypes.c_double.from_address(pointer).value

    def contacts(self, largest_id: int) -> np.ndarray:
        """Rows of every grain-grain contact, (n, 7): first id, second id, periodic flag, spring s (3), overlap.

        The library does not tell n. Ids are positive integers, so their running sum meets the engine's own sum at row n
        and nowhere else; reading ceil(rest / largest id) rows at a time never reads beyond it.
        """
        total = self.scalar("id_sum")
        if total == 0:
            return np.empty((0, CONTACT_COLUMNS))
        pointer = self.library.lammps_extract_compute(self._instance, b"pairs", 2, 2)
        first_row = ctypes.c_void_p.from_address(pointer).value
        n, found = 0, 0.0
        while found < total:
            more = int(-(-(total - found) // largest_id))
            rows = self._rows(first_row, n + more)
            found += rows[n:, 0].sum()
            n += more
        return rows.copy()

    @staticmethod
    def _rows(address: int, n: int) -> np.ndarray:
        return np.ctypeslib.as_array(
            (ctypes.c_double * (CONTACT_COLUMNS * n)).from_address(address)
        ).reshape(n, -1)
