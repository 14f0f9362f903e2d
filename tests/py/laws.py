"""The example laws called as libraries, by way of ctypes, and the laboratory's paths with them.

Everywhere here: compression positive, tensor components xx yy zz xy yz zx, stress in Pa.
"""

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from cases.programs import program

VOIGT = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)]
ABAQUS = [0, 1, 2, 3, 5, 4]  # 11 22 33 12 13 23 of ours, and ours of those
ENGINEERING = np.array([1.0, 1, 1, 2, 2, 2])


@dataclass
class Answer:
    """What a law made of one step."""

    stress: np.ndarray  # (6,) [Pa]
    state: np.ndarray
    stored: float = np.nan  # [J/m3]
    dissipated: float = np.nan  # in this step [J/m3]
    modulus: float = np.nan  # [Pa]
    # d(stress)/d(strain), both ours: a column is a tensor component of strain, the rest held
    tangent: np.ndarray = field(default_factory=lambda: np.full((6, 6), np.nan))
    step: float = 1.0  # PNEWDT


def pointer(array: np.ndarray):
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def doubles(*values: float) -> list:
    return [ctypes.byref(ctypes.c_double(value)) for value in values]


def integers(*values: int) -> list:
    return [ctypes.byref(ctypes.c_int(value)) for value in values]


def library(name: str) -> ctypes.CDLL:
    return ctypes.CDLL(str(program(f"laws/lib{name}.so")))


class Umat:
    """A law that is called as Abaqus does."""

    def __init__(self, name: str, constants: Sequence[float], states: int = 0):
        self.call = library(name).umat_
        self.call.restype = None
        self.constants, self.states = np.array(constants, float), states

    def update(self, stress, strain, state=(), drot=None) -> Answer:
        out = -np.asarray(stress, float)[ABAQUS]
        change = -(np.asarray(strain, float) * ENGINEERING)[ABAQUS]
        state = np.array(state, float) if len(state) else np.zeros(max(self.states, 1))
        tangent = np.zeros((6, 6), order="F")
        turn = np.asfortranarray(np.eye(3) if drot is None else drot)
        zeros, unit = np.zeros(6), np.eye(3)
        sse, spd, step = (ctypes.c_double(value) for value in (0.0, 0.0, 1.0))
        none = doubles(*[0.0] * 8)
        self.call(
            pointer(out), pointer(state), pointer(tangent), ctypes.byref(sse), ctypes.byref(spd),
            none[0], none[1], pointer(np.zeros(6)), pointer(np.zeros(6)), none[2], pointer(zeros),
            pointer(change), pointer(np.zeros(2)), *doubles(1.0), none[3], none[4],
            pointer(np.zeros(1)), pointer(np.zeros(1)), ctypes.create_string_buffer(b" " * 80, 80),
            *integers(3, 3, 6, self.states), pointer(self.constants),
            *integers(len(self.constants)), pointer(np.zeros(3)), pointer(turn),
            ctypes.byref(step), *doubles(1.0), pointer(unit), pointer(unit),
            *integers(1, 1, 1, 1, 1, 1), ctypes.c_size_t(80),
        )  # fmt: skip
        ours = tangent[np.ix_(ABAQUS, ABAQUS)] * ENGINEERING
        return Answer(-out[ABAQUS], state, sse.value, spd.value, ours[0, 0], ours, step.value)


class Esm:
    """A law that is called as Anura3D does."""

    def __init__(self, name: str, constants: Sequence[float]):
        self.call = library(name).esm_
        self.call.restype = None
        self.constants = np.array(constants, float)

    def update(self, stress, strain, state=()) -> Answer:
        out = -np.asarray(stress, float)
        change = -(np.asarray(strain, float) * ENGINEERING)
        modulus, multiplier = ctypes.c_double(), ctypes.c_double()
        self.call(
            *integers(1, 1, 1), pointer(out), ctypes.byref(modulus), ctypes.byref(multiplier),
            pointer(change), *integers(0), pointer(np.zeros(1)), *integers(12),
            pointer(np.zeros(12)), ctypes.create_string_buffer(b" " * 80, 80),
            *integers(len(self.constants)), pointer(self.constants), *integers(1, 6),
            ctypes.c_size_t(80),
        )  # fmt: skip
        return Answer(-out, np.zeros(0), modulus=modulus.value)


class Points(ctypes.Structure):
    """grainpair_block of mpm/external_law.h."""

    _fields_ = [
        ("size", ctypes.c_int),
        ("dt", ctypes.c_double),
        ("constant_count", ctypes.c_int),
        ("constants", ctypes.POINTER(ctypes.c_double)),
        ("state_count", ctypes.c_int),
        ("strain", ctypes.POINTER(ctypes.c_double) * 6),
        ("spin", ctypes.POINTER(ctypes.c_double) * 3),
        ("void_ratio_old", ctypes.POINTER(ctypes.c_double)),
        ("void_ratio", ctypes.POINTER(ctypes.c_double)),
        ("stress", ctypes.POINTER(ctypes.c_double) * 6),
        ("state", ctypes.POINTER(ctypes.POINTER(ctypes.c_double))),
        ("modulus", ctypes.POINTER(ctypes.c_double)),
        ("stored", ctypes.POINTER(ctypes.c_double)),
        ("dissipated", ctypes.POINTER(ctypes.c_double)),
    ]


class Block:
    """A law that is called as grainpair does."""

    def __init__(self, name: str, constants: Sequence[float]):
        self.call = library(name).grainpair_law
        self.call.restype = ctypes.c_int
        self.constants = np.array(constants, float)

    def points(self, stress: np.ndarray, strain: np.ndarray) -> list[Answer]:
        """Of many points at once: (points, 6) each."""
        size = len(stress)
        out, change = np.array(stress, float).T.copy(), np.array(strain, float).T.copy()
        told, none = np.full((3, size), np.nan), np.zeros((5, size))
        row = ctypes.POINTER(ctypes.c_double)
        block = Points(
            size, 1.0, len(self.constants), pointer(self.constants), 0,
            (row * 6)(*map(pointer, change)), (row * 3)(*map(pointer, none[:3])),
            pointer(none[3]), pointer(none[4]), (row * 6)(*map(pointer, out)), None,
            *map(pointer, told),
        )  # fmt: skip
        assert self.call(ctypes.byref(block)) == 0
        return [
            Answer(out[:, i].copy(), np.zeros(0), told[1, i], told[2, i], told[0, i])
            for i in range(size)
        ]

    def update(self, stress, strain, state=()) -> Answer:
        return self.points(np.array([stress]), np.array([strain]))[0]


@dataclass
class Path:
    """What was measured along a path, after every step; strain and stress (steps, 6)."""

    strain: np.ndarray
    stress: np.ndarray
    state: np.ndarray
    dissipated: np.ndarray

    @property
    def mobilised(self) -> np.ndarray:
        """sin of the mobilised angle of friction, axis x."""
        axial, lateral = self.stress[:, 0], self.stress[:, 1]
        return (axial - lateral) / (axial + lateral)

    @property
    def volume(self) -> np.ndarray:
        return self.strain[:, :3].sum(axis=1)


def follow(law, stress, state, steps: np.ndarray, correct: Callable | None = None) -> Path:
    """Strain increments (steps, 6) one after the other; `correct` finds what is not prescribed."""
    stress, state = np.array(stress, float), np.array(state, float)
    rows, total = [], np.zeros(6)
    for step in steps:
        strain = step if correct is None else correct(law, stress, state, step)
        answer = law.update(stress, strain, state)
        stress, state, total = answer.stress, answer.state, total + strain
        rows.append((total, stress, state, answer.dissipated))
    return Path(*(np.array(column) for column in zip(*rows, strict=True)))


def drained(law, stress, state, step):
    """The lateral strain, yy = zz, that leaves the lateral stress what it is; secants."""
    held = stress[1]

    def excess(lateral):
        return (
            law.update(stress, step + lateral * np.array([0, 1, 1, 0, 0, 0]), state).stress[1]
            - held
        )

    low, high = -0.5 * step[0], -0.3 * step[0]
    below, above = excess(low), excess(high)
    for _ in range(60):
        if abs(above) <= 1e-12 * held or above == below:
            break
        low, high = high, high - above * (high - low) / (above - below)
        below, above = above, excess(high)
    assert abs(above) <= 1e-9 * held
    return step + high * np.array([0, 1, 1, 0, 0, 0])


def triaxial(law, pressure: float, state, axial: float, steps: int) -> Path:
    """Drained triaxial compression from an isotropic stress, to an axial strain along x."""
    increments = np.zeros((steps, 6))
    increments[:, 0] = axial / steps
    return follow(law, pressure * np.array([1.0, 1, 1, 0, 0, 0]), state, increments, drained)


def oedometer(law, stress, state, axial: float, steps: int) -> Path:
    increments = np.zeros((steps, 6))
    increments[:, 0] = axial / steps
    return follow(law, stress, state, increments)
