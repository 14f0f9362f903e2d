"""The contacts of a moment and the energy accounts of a collapse, as the library of
dem_reference/ledger/ makes them within this process: it reads what the engine holds where it lies.

What is rebuilt and what counts for what is told there (moment.hpp, accounts.hpp).
"""

import ctypes
from ctypes import POINTER, Structure, byref, c_bool, c_double, c_int32, c_int64, c_void_p
from functools import cache
from math import prod
from typing import Any, NamedTuple

import numpy as np

from cases.errors import EngineError
from cases.programs import program

from .grains import Grains
from .scene import Plane

LIBRARY = "grain_ledger.so"
VECTORS = ("x", "v", "f", "omega", "torque")
ROLLING = ("none", "epsd", "epsd2")  # places are the codes of moment.hpp
PLAIN_COLUMNS, ROLLING_COLUMNS = 7, 10  # of the engine's contacts, as there


class Scene(Structure):
    """As in moment.hpp."""

    _fields_ = [
        (name, c_double)
        for name in (
            "radius",
            "mass",
            "inertia",
            "contact_modulus",
            "contact_shear_modulus",
            "damping_factor",
            "friction",
            "wall_damping_factor",
            "rolling_model",
            "rolling_friction",
            "rolling_damping",
            "time_step",
            "gravity",
            "thickness",
            "length",
            "pull",
        )
    ]


class Atoms(Structure):
    """As in moment.hpp: addresses of arrays, (count, 3) and (count,); radius none where all grains
    are alike.
    """

    _fields_ = [(name, c_int64) for name in ("count", "owned")] + [
        (name, c_void_p) for name in (*VECTORS, "id", "type", "radius")
    ]


class Held(Structure):
    """As in moment.hpp [J]; force_error [N], torque_error [N m]."""

    _fields_ = [
        (name, c_double)
        for name in (
            "kinetic",
            "rotational",
            "potential",
            "normal",
            "tangential",
            "rolling",
            "wall",
            "force_error",
            "torque_error",
        )
    ]

    @property
    def elastic(self) -> float:
        return self.normal + self.tangential + self.rolling + self.wall

    @property
    def total(self) -> float:
        return self.kinetic + self.rotational + self.potential + self.elastic


class _View(Structure):
    _fields_ = [
        ("pairs", c_void_p),
        ("touches", c_void_p),
        ("pair_count", c_int64),
        ("touch_count", c_int64),
        ("held", Held),
    ]


class _Row(Structure):
    _fields_ = [("dissipated", c_double * 6), ("enduring", c_double * 4)] + [
        (name, c_double) for name in ("force_error", "torque_error")
    ]


# What accounts carry of a contact from sample to sample, as in lifetimes.hpp.
CARRIED = np.dtype(
    [("key", "u8"), ("age", "f8"), ("account", "f8", 3), ("held", "f8", 3), ("goes_on", "?")],
    align=True,
)


class _Classes(Structure):
    _fields_ = [(name, c_void_p) for name in ("edges", "multiples", "heat", "count")] + [
        (name, c_int64) for name in ("faces", "thresholds")
    ]


PLANE = np.dtype(
    [(name, "f8") for name in ("position", "friction", "lowest", "begin", "rise")]
    + [(name, "i8") for name in ("code", "axis")]
)
PAIR = np.dtype(
    [(name, "i8") for name in ("first", "second", "counts", "key")]
    + [(name, "f8", 3) for name in ("branch", "normal", "force", "torque")]
    + [(name, "f8") for name in ("arm", "overlap")]
    + [(name, "f8", 3) for name in ("elastic", "power", "work_rate")]
)
TOUCH = np.dtype(
    [(name, "i8") for name in ("grain", "code", "rough")]
    + [(name, "f8", 3) for name in ("normal", "branch", "force")]
    + [(name, "f8") for name in ("overlap", "elastic", "power", "work_rate", "driven")]
)


@cache
def library() -> ctypes.CDLL:
    """The library of the build; EngineError where there is none."""
    path = program(LIBRARY)
    try:
        out = ctypes.CDLL(str(path))
    except OSError:
        why = "cannot be loaded" if path.exists() else "not built"
        raise EngineError(
            f"{path}: no such library ({why}) any ./grainpair run builds it"
        ) from None
    handle, real, yes = c_void_p, c_double, c_bool
    functions: list[tuple[Any, ...]] = [
        ("moment_new", handle, POINTER(Scene)),
        ("moment_delete", None, handle),
        (
            *("moment_look", yes, handle, POINTER(Atoms), handle, c_int64),
            *(handle, c_int64, POINTER(_View)),
        ),
        ("contact_count", c_int64, handle, real, c_int64),
        ("fluctuation", real, POINTER(Atoms), real, real, yes),
        ("accounts_new", handle, handle, real, yes, real, real),
        ("accounts_delete", None, handle),
        ("accounts_add", None, handle, handle),
        ("accounts_row", None, handle, handle, POINTER(_Row)),
        ("accounts_by_grain", None, handle, handle, handle),
        ("accounts_by_id", None, handle, handle, handle, c_int64),
        ("accounts_leave", c_int64, handle, handle, c_int64, c_int32, POINTER(handle)),
        ("accounts_join", None, handle, handle, c_int64),
        ("accounts_state", c_int64, handle, handle),
        ("accounts_take_up", yes, handle, handle, c_int64),
        ("accounts_finish", None, handle),
        ("accounts_classes", None, handle, POINTER(_Classes)),
    ]
    for name, result, *arguments in functions:
        function = getattr(out, name)
        function.restype, function.argtypes = result, arguments
    return out


def array(address: int | None, dtype: np.dtype | type, *shape: int) -> np.ndarray:
    """A view of memory that somebody else holds."""
    size = prod(shape) * np.dtype(dtype).itemsize
    if not size:
        return np.empty(shape, dtype)
    memory: Any = (ctypes.c_char * size).from_address(address or 0)
    return np.frombuffer(memory, dtype).reshape(shape)


def planes_of(walls: list[Plane]) -> np.ndarray:
    """Walls as the library takes them (n,)."""
    rows = [(w.position, w.friction, w.lowest, w.begin, w.rise, w.code, w.axis) for w in walls]
    return np.array(rows, PLANE)


def atoms_of(arrays: dict[str, np.ndarray], owned: int | None = None) -> Atoms:
    """Of arrays as Liggghts.atoms gives them, whose memory has to stay as long as it is used; of
    them the first `owned` are this rank's, all of them unless told.
    """
    n = len(arrays["id"])
    radius = arrays["radius"].ctypes.data if "radius" in arrays else None
    places = (arrays[name].ctypes.data for name in ARRAYS)
    return Atoms(n, n if owned is None else owned, *places, radius)


ARRAYS = {name: np.float64 for name in VECTORS} | {"id": np.int32, "type": np.int32}


def fluctuation_energy(atoms: Atoms, grains: Grains, radial: bool) -> float:
    """The part of the moving grains' kinetic energy that is not coarse motion (fluctuation.hpp)
    [J]; radial: whether coarse motion depends on the distance from the y axis, not on x.
    """
    return library().fluctuation(byref(atoms), grains.diameter, grains.mass, radial)


class Moment:
    """All contacts of a moment; made once, it looks as often as wanted."""

    def __init__(
        self,
        grains: Grains,
        dt: float,
        gravity: float,
        thickness: float | None,
        length: float | None = None,
        pull: float = 0.0,
    ):
        """dt: time step [s]; gravity along -y and pull along x [m/s2]; thickness and length:
        periods along z and x [m].
        """
        values = [getattr(grains, name) for name, _ in Scene._fields_[:8]]  # to the walls' damping
        model = ROLLING.index(grains.rolling_model) if grains.rolls else 0
        rolling = (model, grains.rolling_friction, grains.rolling_damping)
        scene = Scene(*values, *rolling, dt, gravity, thickness or 0.0, length or 0.0, pull)
        self.library, self.grains, self.dt = library(), grains, dt
        self._handle, self._view = self.library.moment_new(byref(scene)), _View()
        self.atoms = Atoms()

    def __del__(self):
        if handle := getattr(self, "_handle", None):
            self.library.moment_delete(handle)

    @property
    def handle(self) -> int:
        return self._handle

    def look(self, atoms: Atoms, rows: int | None, count: int, planes: np.ndarray) -> None:
        """Takes up grains, `count` contacts at the address `rows`, each as in Liggghts.contacts,
        and the walls that stand; `atoms` stays valid as long as what is asked of this moment.
        """
        self.atoms = atoms
        if not self.library.moment_look(
            self._handle,
            byref(atoms),
            rows,
            count,
            planes.ctypes.data,
            len(planes),
            byref(self._view),
        ):
            raise EngineError("LIGGGHTS: told of a contact of a grain that it does not hold")

    @property
    def held(self) -> Held:
        """What grains and contacts hold."""
        return self._view.held

    @property
    def everyone(self) -> Atoms:
        """All grains of the scene."""
        return self.atoms

    @property
    def pairs(self) -> np.ndarray:
        """A copy of the contacts of grains (n,), of type PAIR."""
        return array(self._view.pairs, PAIR, self._view.pair_count).copy()

    @property
    def touches(self) -> np.ndarray:
        """A copy of the contacts with walls (m,), of type TOUCH."""
        return array(self._view.touches, TOUCH, self._view.touch_count).copy()


class Sums(NamedTuple):
    """Dissipated since the release [J]."""

    normal: float
    tangential: float
    base: float  # of pairs: in contacts with glued grains
    wall: float
    rolling: float
    driven: float  # no dissipation: what walls that move have done on the grains

    @property
    def pairs(self) -> float:
        return self.normal + self.tangential + self.rolling


class Lifetimes(NamedTuple):
    """The dissipation by classes of lifetime [binary contact times]: n faces, n + 1 classes."""

    edges: np.ndarray
    multiples: np.ndarray  # of the threshold: those whose split is kept over time
    heat: np.ndarray  # normal, tangential, rolling (n + 1, 3) [J]
    contacts: np.ndarray  # how many


class Accounts:
    """What contacts dissipate from the release on (accounts.hpp)."""

    def __init__(
        self, start: Moment, interval: float, every_step: bool, unit: float, threshold: float
    ):
        """interval: between samples [s], one time step if `every_step`; unit: binary contact time
        [s]; threshold: of an enduring contact, in units.
        """
        self.library = library()
        self._handle = self.library.accounts_new(
            start.handle, interval, every_step, unit, threshold
        )

    def __del__(self):
        if handle := getattr(self, "_handle", None):
            self.library.accounts_delete(handle)

    def add(self, moment: Moment) -> None:
        """One sample."""
        self.library.accounts_add(self._handle, moment.handle)

    def row(self, moment: Moment) -> tuple[Sums, np.ndarray, tuple[float, float]]:
        """Dissipated by now; by contacts older than each threshold (4,) [J]; the largest errors of
        force [N] and torque [N m] of the samples.
        """
        row = _Row()
        self.library.accounts_row(self._handle, moment.handle, byref(row))
        errors = (row.force_error, row.torque_error)
        return Sums(*row.dissipated), np.array(row.enduring), errors

    def by_grain(self, moment: Moment) -> np.ndarray:
        """Dissipated by now by the contacts of each grain, in the moment's order (n,) [J]."""
        out = np.empty(moment.atoms.count)
        self.library.accounts_by_grain(self._handle, moment.handle, out.ctypes.data)
        return out

    def by_id(self, moment: Moment, size: int) -> np.ndarray:
        """What these accounts have seen of it, of all ids below `size` (size,) [J]."""
        out = np.empty(size)
        self.library.accounts_by_id(self._handle, moment.handle, out.ctypes.data, size)
        return out

    def leave(self, owners: np.ndarray, own: int) -> np.ndarray:
        """Takes out what is carried of contacts whose grain of the lower id is not `own`'s any
        more, by the owner of each id (size,), of type CARRIED.
        """
        owners, gone = np.ascontiguousarray(owners, np.int32), c_void_p()
        count = self.library.accounts_leave(
            self._handle, owners.ctypes.data, owners.size, own, byref(gone)
        )
        return array(gone.value, CARRIED, count).copy()

    def join(self, carried: np.ndarray) -> None:
        """Puts in what `leave` has told of other accounts, between the same samples."""
        carried = np.ascontiguousarray(carried, CARRIED)
        self.library.accounts_join(self._handle, carried.ctypes.data, carried.size)

    def lifetimes(self) -> Lifetimes:
        """The split by lifetime of the contacts that have ended."""
        told = _Classes()
        self.library.accounts_classes(self._handle, byref(told))
        classes = told.faces + 1
        return Lifetimes(
            array(told.edges, np.float64, told.faces).copy(),
            array(told.multiples, np.float64, told.thresholds).copy(),
            array(told.heat, np.float64, classes, 3).copy(),
            array(told.count, np.int64, classes).copy(),
        )

    def state(self) -> np.ndarray:
        """All that samples have changed since the release (n,) [bytes]."""
        out = np.empty(self.library.accounts_state(self._handle, None), np.uint8)
        self.library.accounts_state(self._handle, out.ctypes.data)
        return out

    def take_up(self, state: np.ndarray) -> None:
        """Goes on with what `state` has told of other accounts."""
        state = np.ascontiguousarray(state, np.uint8)
        if not self.library.accounts_take_up(self._handle, state.ctypes.data, state.size):
            raise EngineError("checkpoint: of other accounts than those of this run")

    def finish(self) -> None:
        """The contacts still standing go to the class of their age."""
        self.library.accounts_finish(self._handle)
