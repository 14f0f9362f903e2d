"""Runs of either engine and the fields mapped from them, read from HDF5."""

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, overload

import h5py
import numpy as np

from cases import reading
from cases.case import Case, parse
from cases.errors import CaseError, EngineError
from cases.programs import call, program

if TYPE_CHECKING:
    from compare.mapping.dissipation import InPlace

GLUED = 3  # record `kind` of a grain that belongs to the wall
POINT_STATE = (
    "regime",
    "void_ratio",
    "deviatoric_strain",
    "plastic_dissipation",
    "regime_4_dissipation",
    "contact_dissipation",
)
SYMMETRIC = ("xx", "yy", "zz", "xy", "yz", "zx")
# of material points [J/kg]
DISSIPATION = {name for name in POINT_STATE if name.endswith("_dissipation")}


@dataclass(frozen=True)
class Cloud:
    """What moves, at one instant: x, v of shape (N, 3) [m, m/s], mass (N,) [kg], solid_volume (N,)
    [m3].

    `state` is what points know themselves, each (N,): "dissipated" [J] since the release, by the
    contacts of a grain or in all accounts of a material point; and of material
    points records of POINT_STATE by name, "pressure" [Pa], a third of the trace of the stress, and
    "stress" [Pa], its Frobenius norm. A point keeps its row.
    """

    x: np.ndarray
    v: np.ndarray
    mass: np.ndarray
    solid_volume: np.ndarray
    state: dict = field(default_factory=dict)


class StoredClouds(Sequence[Cloud]):
    """The frames of a result file; each is read when it is asked for, the last one kept. Raises
    CaseError where one cannot be read or holds numbers that are none.
    """

    def __init__(self, path: Path, steps: list[int]):
        self.path, self.steps = path, steps
        self.kept: tuple[int, Cloud] | None = None

    def __len__(self) -> int:
        return len(self.steps)

    @overload
    def __getitem__(self, i: int) -> Cloud:
        ...

    @overload
    def __getitem__(self, i: slice) -> list[Cloud]:
        ...

    def __getitem__(self, i: int | slice) -> Cloud | list[Cloud]:
        if isinstance(i, slice):
            return [self[k] for k in range(*i.indices(len(self)))]
        step = self.steps[i]
        if self.kept is None or self.kept[0] != step:
            self.kept = (step, self.read(step))
        return self.kept[1]

    def read(self, step: int) -> Cloud:
        with reading.result(self.path) as f:
            return cloud_of(reading.group(f, f"data/{step}/particles/cloud"))


def cloud_of(cloud: h5py.Group) -> Cloud:
    """What moves of a frame's particles."""
    mass = reading.values(cloud, "mass")
    count = len(mass)
    volume = volumes(cloud, count)
    for name, found in (("mass", mass), ("solid_volume", volume)):
        if np.any(found <= 0.0):
            row = int(np.flatnonzero(found <= 0.0)[0])
            raise CaseError(f"{reading.where(cloud)}/{name}: row {row} is {found[row]:g} (not > 0)")
    if "positionOffset" in cloud and np.any(reading.vectors(cloud, "positionOffset", count)):
        raise CaseError(f"{reading.where(cloud)}/positionOffset: not zero (positions are absolute)")
    moving = np.ones(count, bool)
    if "kind" in cloud:
        moving = reading.values(cloud, "kind", count) != GLUED
    of_points = [name for name in POINT_STATE if name in cloud]
    state = {name: reading.values(cloud, name, count)[moving] for name in of_points}
    if "stress" in cloud:
        xx, yy, zz, *shear = (
            reading.values(cloud, f"stress/{name}", count)[moving] for name in SYMMETRIC
        )
        state["pressure"] = (xx + yy + zz) / 3.0
        state["stress"] = np.sqrt(sum(s * s for s in (xx, yy, zz, *shear, *shear)))
    if "dissipated" in cloud:
        state["dissipated"] = reading.values(cloud, "dissipated", count)[moving]
    elif DISSIPATION <= state.keys():
        state["dissipated"] = mass[moving] * sum(state[name] for name in DISSIPATION)
    x, v = (reading.vectors(cloud, name, count)[moving] for name in ("position", "velocity"))
    return Cloud(x, v, mass[moving], volume[moving], state)


def volumes(cloud: h5py.Group, count: int) -> np.ndarray:
    """Solid volumes (N,) [m3], told or of spheres; NaN where points of another program tell
    neither.
    """
    if "solid_volume" in cloud:
        return reading.values(cloud, "solid_volume", count)
    if "radius" in cloud:
        return 4.0 / 3.0 * np.pi * reading.values(cloud, "radius", count) ** 3
    return np.full(count, np.nan)


@dataclass(frozen=True)
class Grid:
    """Centres x (nx,) and y (ny,) [m] of the cells that fields of shape (ny, nx) belong to;
    cell_volume [m3].
    """

    x: np.ndarray
    y: np.ndarray
    cell_volume: float

    @property
    def spacing(self) -> float:
        return self.x[1] - self.x[0]


@dataclass
class Fields:
    """Fields of one run: fields["density"] has shape (frames, ny, nx), tensors a trailing
    (3, 3).
    """

    grid: Grid
    time: np.ndarray
    values: Mapping  # arrays by name, or a group of a file
    attributes: dict = field(default_factory=dict)  # of the file: kernel, width, spacing
    loaded: dict[str, np.ndarray] = field(default_factory=dict)

    def __contains__(self, name):
        return name in self.values

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self.loaded:
            self.loaded[name] = np.asarray(self.values[name][...], dtype=float)
        return self.loaded[name]


@dataclass
class Run:
    """One run: its case, its frames, its energy history [J] and the fields mapped from it.

    `mass_scale` multiplies mass and energies, so that both clouds of a pair weigh the same: a slab
    of plane strain is as well a slab that much thicker. `reference_energy` [J] is the energy the
    grains release. `dissipation` is what compare.mapping.dissipation.in_place has made of the
    frames, or what a signature keeps in their place.
    """

    name: str
    engine: str
    case: Case
    time: np.ndarray  # of the frames [s]
    clouds: Sequence[Cloud]
    energy: dict[str, np.ndarray]
    attributes: dict = field(default_factory=dict)
    mapped: Fields | None = None
    mass_scale: float = 1.0
    reference_energy: float = 1.0
    dissipation: "InPlace | None" = None

    @property
    def fields(self) -> Fields:
        """The fields mapped from the run; raises ValueError where nothing has been mapped yet."""
        if self.mapped is None:
            raise ValueError(f"{self.name}: no fields have been mapped from this run")
        return self.mapped

    @property
    def time_scale(self) -> float:
        """sqrt(H/g) [s]"""
        return float(np.sqrt(self.case["geometry.height"] / self.case["geometry.gravity"]))

    @property
    def length(self) -> float:
        return self.case["geometry.length"]

    @property
    def height(self) -> float:
        return self.case["geometry.height"]

    @property
    def diameter(self) -> float:
        return self.case["grains.diameter"]

    @cached_property
    def mass(self) -> float:
        """[kg], not scaled"""
        return float(np.sum(self.clouds[0].mass))

    def tau(self) -> np.ndarray:
        """Times of the frames in sqrt(H/g)."""
        return self.time / self.time_scale

    def energy_tau(self) -> np.ndarray:
        return self.energy["time"] / self.time_scale

    def joules(self, name: str) -> np.ndarray:
        """A column of the energy history, scaled by mass [J]; zero where the engine has none."""
        return self.mass_scale * self.energy.get(name, np.zeros_like(self.energy["time"]))

    def normalised(self, name: str) -> np.ndarray:
        """The same in units of the reference energy."""
        return self.joules(name) / self.reference_energy

    def mean_motion(self) -> np.ndarray:
        """Translational kinetic energy of the mean motion, in units of the reference energy.

        The continuum's kinetic energy is that; its fluctuations are an account of their own. The
        grains' holds both, so what is not coarse motion (dem_reference/ledger/fluctuation.hpp) is
        taken off, where it was sampled.
        """
        kinetic = self.normalised("kinetic")
        return kinetic - self.normalised("fluctuation") if self.engine == "dem" else kinetic

    def released(self) -> float:
        """Potential energy at release minus that at the end [J]."""
        potential = self.joules("potential")
        return float(potential[0] - potential[-1])


REGIME = "dissipated_regime_4"  # without it a budget would have a hole that looks like zero
UNKNOWN = ("unaccounted",)  # accounts that are NaN where nobody audited them
POSITIVE = (
    "geometry.height",
    "geometry.length",
    "geometry.thickness",
    "geometry.gravity",
    "grains.diameter",
    "grains.density",
    "compare.width",
    "compare.spacing",
)
# Attributes of a file's root by their type, and what stands for those that a file lacks.
TEXTS = ("engine_version", "commit", "command", "date", "end_reason", "warnings", "contradictions")
NUMBERS = ("seed", "wall_seconds", "time_scale", "softening_error", "weight_to_stiffness")
UNTOLD = {"commit": "unknown", "command": "unknown", "date": "unknown", "seed": -1} | {
    "cpu_seconds": math.nan
}


def seconds_of(run: Run, name: str) -> float:
    """An attribute of a run's file in seconds; NaN where the file does not tell it."""
    return float(run.attributes.get(name, np.nan))


@dataclass(frozen=True)
class CloudFile:
    """What every result file tells, with a case or without: `attributes` of its root, and its
    frames at `time` [s], NaN where that is not told.
    """

    path: Path
    engine: str
    attributes: dict
    time: np.ndarray
    clouds: StoredClouds


def open_grains(path: str | Path) -> CloudFile:
    """The frames of a result file, such as grains.h5, for which no case is needed; raises CaseError
    when it is not one. Sizes and types of all frames are checked, their numbers when they are read.
    """
    path = Path(path)
    with reading.result(path) as f:
        told = checked(path, UNTOLD | reading.attributes(f))
        engine = told.get("engine")
        if engine not in ("mpm", "dem"):
            raise CaseError(f"{path}: attribute engine is {engine!r} (neither 'mpm' nor 'dem')")
        names = list(reading.group(f, "data"))
        strange = [name for name in names if not name.isdecimal() or str(int(name)) != name]
        if strange or not names:
            found = f"{strange[0]!r} is no step" if strange else "no frames"
            raise CaseError(f"{path}:/data: {found}")
        steps = sorted(map(int, names))
        time = np.array([check_frame(reading.group(f, f"data/{step}")) for step in steps])
    return CloudFile(path, engine, told, time, StoredClouds(path, steps))


def checked(path: Path, told: dict) -> dict:
    """Attributes of a root, those that are known of the type that they are known by."""
    for name, value in told.items():
        if name in TEXTS and not isinstance(value, str):
            raise CaseError(f"{path}: attribute {name} is {value!r} (no text)")
        if name in NUMBERS or name.startswith("cpu_seconds"):
            if not reading.is_number(value):
                raise CaseError(f"{path}: attribute {name} is {value!r} (no number)")
    return told


def check_frame(frame: h5py.Group) -> float:
    """The time of a frame [s], whose records agree in their length."""
    time = frame.attrs.get("time", "missing")
    if not reading.is_number(time):
        raise CaseError(f"{reading.where(frame)}: attribute time is {reading.plain(time)!r}")
    cloud = reading.group(frame, "particles/cloud")
    count = reading.length(cloud, "mass")
    needed = [f"{r}/{k}" for r in ("position", "velocity") for k in "xyz"]
    scalars = (
        "solid_volume",
        "id",
        "kind",
        "radius",
        "dissipated",
        "granular_temperature",
        *POINT_STATE,
    )
    known = [name for name in scalars if name in cloud]
    known += [f"angular_velocity/{k}" for k in "xyz" if "angular_velocity" in cloud]
    known += [f"stress/{k}" for k in SYMMETRIC if "stress" in cloud]
    for name in [*needed, *known]:
        reading.length(cloud, name, count)
    return float(time)


def open_run(path: str | Path) -> Run:
    """The run of a result file; raises CaseError when it is not one, such as grains without a
    case.
    """
    found = open_grains(path)
    path, told, engine = found.path, found.attributes, found.engine
    if "case_resolved" not in told:
        raise CaseError(f"{path}: needs a case (the file has none) give --case when importing it")
    scene = parse(told["case_resolved"], path)
    for key in POSITIVE:
        check_positive(scene, key)
    several = len(found.time) > 1
    if several and not (np.all(np.isfinite(found.time)) and np.all(np.diff(found.time) > 0.0)):
        raise CaseError(f"{path}: the times of its frames do not increase from frame to frame")
    with reading.result(path) as f:
        accounts = reading.group(f, "energy")
        unknown = UNKNOWN if several else (*UNKNOWN, "time")
        energy = reading.columns(accounts, ("time", *accounts), unknown)
    for name in ("kinetic", "potential", *([REGIME] if engine == "mpm" else [])):
        if name not in energy and "source" not in told:  # else it is another program's
            why = " (a file of another version of grainpair) run the case again"
            raise CaseError(f"{path}: energy/{name} is missing{why if name == REGIME else ''}")
    rows = len(energy["time"])
    if not rows or np.any(np.diff(energy["time"]) < 0.0):
        raise CaseError(f"{path}: energy/time holds {rows} times that do not increase")
    return Run(path.stem, engine, scene, found.time, found.clouds, energy, told)


def check_positive(scene: Case, key: str):
    section, name = key.split(".")
    value = scene[section].get(name)
    if value is None or not 0.0 < value < np.inf:
        raise CaseError(f"{scene.path}: case_resolved: {key} is {value} (not > 0)")


def map_fields(runs: list[Path], output: Path, *options):
    """Calls grain_map; raises CaseError with its line for a file that it cannot map, EngineError
    when it fails.
    """
    command = [program("grain_map"), *runs, "-o", output, "--quiet", *options]
    environment = os.environ | {
        "GOMP_SPINCOUNT": "0"
    }  # waiting threads leave the cores to the engines
    done = call(command, env=environment)
    if done.returncode == 2:
        raise CaseError(done.stderr.strip())
    if done.returncode:
        raise EngineError(done.stderr.strip() or f"grain_map: failed with code {done.returncode}")


def open_fields(path: str | Path, name: str) -> Fields:
    """Fields of the run `name` in a file of grain_map."""
    f = reading.opened(path)
    grid = Grid(f["grid/x"][:], f["grid/y"][:], float(f["grid"].attrs["cell_volume"]))
    return Fields(grid, f[name]["time"][:], f[name], reading.attributes(f))
