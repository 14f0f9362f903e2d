"""LIGGGHTS as a library: a periodic box of grains driven step by step through ctypes."""
import ctypes as C
import multiprocessing
import os
from pathlib import Path

import numpy as np

from cases.errors import EngineError
from dem_reference.element.grains import Grains
from dem_reference.element.packing import random_positions

SETUP = """\
atom_style granular
atom_modify map array
boundary p p p
newton off
communicate single vel yes
units si
processors * 1 1
region box block 0 {side} 0 {side} 0 {side} units box
create_box 1 box
neighbor {d} bin
neigh_modify delay 0
fix m1 all property/global youngsModulus peratomtype {E}
fix m2 all property/global poissonsRatio peratomtype {nu}
fix m3 all property/global coefficientRestitution peratomtypepair 1 {e}
fix m4 all property/global coefficientFriction peratomtypepair 1 {mu}
pair_style gran model hertz {tangential}
pair_coeff * *
timestep {dt}
"""
STATE = """\
fix move all nve/sphere
compute st all stress/atom
compute sxx all reduce sum c_st[1]
compute syy all reduce sum c_st[2]
compute szz all reduce sum c_st[3]
compute sxy all reduce sum c_st[4]
compute con all contact/atom
compute z all reduce ave c_con
thermo_style custom step atoms c_sxx c_syy c_szz c_sxy c_z
thermo_modify lost error norm no flush yes
thermo 1000000000
"""


class Engine:
    """A LIGGGHTS instance. It ends the whole process on an error, so it belongs in a child process: see `in_child`."""

    def __init__(self, log: Path):
        C.CDLL("libmpi.so.40", mode=C.RTLD_GLOBAL)
        self._library = C.CDLL("libliggghts.so.3", mode=C.RTLD_GLOBAL)
        self._library.lammps_extract_atom.restype = C.c_void_p
        self._library.lammps_extract_compute.restype = C.c_void_p
        self._library.lammps_extract_global.restype = C.POINTER(C.c_double)
        words = ["liggghts", "-log", str(log), "-screen", "/dev/null"]
        self._handle = C.c_void_p()
        self._library.lammps_open_no_mpi(
            len(words),
            (C.c_char_p * len(words))(*(w.encode() for w in words)),
            C.byref(self._handle),
        )

    def command(self, line: str) -> None:
        self._library.lammps_command(self._handle, line.encode())

    def commands(self, lines: str) -> None:
        for line in lines.splitlines():
            self.command(line)

    def create(self, centres: np.ndarray, kind: int = 1) -> None:
        """Puts grains of type `kind` at `centres`, shape (count, 3) [m]."""
        for x, y, z in centres:
            self.command(f"create_atoms {kind} single {x:.17g} {y:.17g} {z:.17g} units box")

    def run(self, steps: int) -> None:
        """Goes on by `steps` from where the last run ended, without setting up anew."""
        self.command(f"run {steps} pre no post no")

    def array(self, name: str, count: int) -> np.ndarray:
        """A view of the engine's per-atom vectors x, v, f or omega, shape (count, 3); valid until the next run."""
        return _rows(self._library.lammps_extract_atom(self._handle, name.encode()), count, 3)

    def kinds(self, count: int) -> np.ndarray:
        """Type of every grain, in the order of `array`."""
        return np.ctypeslib.as_array(
            C.cast(self._library.lammps_extract_atom(self._handle, b"type"), C.POINTER(C.c_int)),
            shape=(count,),
        )

    def compute(self, name: str) -> float:
        """The value of a global scalar compute at this instant."""
        return C.cast(
            self._library.lammps_extract_compute(self._handle, name.encode(), 0, 0),
            C.POINTER(C.c_double),
        )[0]

    def compute_array(self, name: str, count: int, columns: int) -> np.ndarray:
        """A view of a per-atom compute's array, shape (count, columns), at this instant."""
        return _rows(
            self._library.lammps_extract_compute(self._handle, name.encode(), 1, 2), count, columns
        )

    def extent(self, name: str) -> float:
        """A coordinate of the simulation box such as boxxhi [m]."""
        return self._library.lammps_extract_global(self._handle, name.encode())[0]


def _rows(address: int, count: int, columns: int) -> np.ndarray:
    """The engine's double** as a numpy array over the same memory."""
    return np.ctypeslib.as_array(
        C.cast(address, C.POINTER(C.POINTER(C.c_double)))[0], shape=(count, columns)
    )


class Box(Engine):
    """Grains in a periodic box whose sides may move. Lengths in m, stresses in Pa (compression positive), rates in 1/s."""

    def __init__(
        self,
        grains: Grains,
        count: int,
        side: float,
        seed: int,
        friction: float,
        time_step: float,
        log: Path,
        tangential: bool = True,
    ):
        super().__init__(log)
        self.grains, self.count, self.time_step = grains, count, time_step
        centres, d0 = random_positions(count, side, seed)
        self.commands(
            SETUP.format(
                side=side,
                d=grains.diameter,
                E=grains.young_modulus,
                nu=grains.poisson_ratio,
                e=grains.restitution,
                mu=friction,
                tangential="tangential history" if tangential else "",
                dt=time_step,
            )
        )
        self.create(centres)
        self.command(f"set group all density {grains.density} diameter {d0:.17g}")
        self.commands(STATE)
        self._grow(d0)

    def _grow(self, d0: float, steps: int = 20000) -> None:
        """Grows the grains from d0 [m] to their own diameter."""
        d = self.grains.diameter
        self.commands(
            f"variable d equal ramp({d0:.17g},{d})\nfix grow all adapt 20 atom diameter v_d\n"
            f"run {steps} post no\nunfix grow\nset group all diameter {d} density {self.grains.density}\n"
            f"neighbor {0.2 * d} bin\nrun 0 post no"
        )

    def deform(self, rates: np.ndarray, steps: int) -> None:
        """Goes on by `steps` while the box's sides shrink at `rates`, shape (3,) [1/s]; the grains follow affinely."""
        words = " ".join(f"{axis} erate {-rate:.12g}" for axis, rate in zip("xyz", rates))
        self.command(f"fix shape all deform 1 {words} remap v")
        self.command(f"run {steps} post no")

    def set_friction(self, friction: float) -> None:
        self.command(f"fix m4 all property/global coefficientFriction peratomtypepair 1 {friction}")
        self.command("run 0 post no")

    @property
    def sides(self) -> np.ndarray:
        """Lengths of the box's sides, shape (3,) [m]."""
        return np.array(
            [self.extent(f"box{axis}hi") - self.extent(f"box{axis}lo") for axis in "xyz"]
        )

    @property
    def void_ratio(self) -> float:
        """Volume of voids over volume of grains, overlaps counted as solid twice [-]."""
        return self.sides.prod() / (self.count * self.grains.volume) - 1

    @property
    def stress(self) -> np.ndarray:
        """Principal stresses along the axes, shape (3,) [Pa]."""
        return -np.array([self.compute(name) for name in ("sxx", "syy", "szz")]) / self.sides.prod()


def in_child(function, *arguments, log: Path):
    """function(*arguments) in a forked process; EngineError with LIGGGHTS's own words if the engine ends it."""
    context = multiprocessing.get_context("fork")
    results, sender = context.Pipe(duplex=False)

    def work():
        sender.send(function(*arguments))
        sender.close()
        os._exit(0)

    child = context.Process(target=work)
    child.start()
    sender.close()
    try:
        result = results.recv()
    except EOFError:
        result = None
    child.join()
    if child.exitcode:
        text = log.read_text(errors="replace") if log.exists() else ""
        errors = [line for line in text.splitlines() if "ERROR" in line]
        raise EngineError(
            f"liggghts: {errors[0] if errors else 'no message'} (exit code {child.exitcode}) see {log}"
        )
    return result
