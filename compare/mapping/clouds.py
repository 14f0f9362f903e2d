"""The frames of a result file: clouds of what moves, read from HDF5 and checked as they are."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import overload

import h5py
import numpy as np

from cases import reading
from cases.errors import CaseError

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


# Attributes of a file's root by their type, and what stands for those that a file lacks.
TEXTS = ("engine_version", "commit", "command", "date", "end_reason", "warnings", "contradictions")
NUMBERS = ("seed", "wall_seconds", "time_scale", "softening_error", "weight_to_stiffness")
UNTOLD = {"commit": "unknown", "command": "unknown", "date": "unknown", "seed": -1} | {
    "cpu_seconds": math.nan
}


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
    CaseError where one cannot be read or holds numbers that are none. Where `sector` is
    told, x and v have the components radius, height, angle about the axis x = z = 0, and what a
    frame holds is divided by it.
    """

    def __init__(self, path: Path, steps: list[int]):
        self.path, self.steps = path, steps
        self.sector: float | None = None
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

    def records(self, i: int, names: Iterable[str]) -> dict[str, np.ndarray]:
        """Scalar records (N,) by name of what moves in frame i; those that the file lacks are left
        out.
        """
        with reading.result(self.path) as f:
            cloud = reading.group(f, f"data/{self.steps[i]}/particles/cloud")
            moving = moving_of(cloud, count := reading.length(cloud, "mass"))
            return {
                name: reading.values(cloud, name, count)[moving] for name in names if name in cloud
            }

    def read(self, step: int) -> Cloud:
        with reading.result(self.path) as f:
            found = cloud_of(reading.group(f, f"data/{step}/particles/cloud"))
        return turned(found, self.sector) if self.sector else found


def turned(cloud: Cloud, sector: float) -> Cloud:
    """With the components radius, height, angle of places and velocities; of places the last is
    zero. What points are whole circles of is divided by `sector`.
    """
    r = np.hypot(cloud.x[:, 0], cloud.x[:, 2])
    cos, sin = (np.divide(part, r, np.ones(len(r)), where=r > 0.0) for part in cloud.x.T[::2])
    v = cloud.v.copy()
    v[:, 0] = cos * cloud.v[:, 0] + sin * cloud.v[:, 2]
    v[:, 2] = cos * cloud.v[:, 2] - sin * cloud.v[:, 0]
    x = np.stack([r, cloud.x[:, 1], np.zeros(len(r))], axis=1)
    state = cloud.state
    if "dissipated" in state:
        state = state | {"dissipated": state["dissipated"] / sector}
    return Cloud(x, v, cloud.mass / sector, cloud.solid_volume / sector, state)


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
    moving = moving_of(cloud, count)
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


def moving_of(cloud: h5py.Group, count: int) -> np.ndarray:
    """Which of the particles (N,) belong to no wall."""
    if "kind" not in cloud:
        return np.ones(count, bool)
    return reading.values(cloud, "kind", count) != GLUED


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
        if not isinstance(engine, str) or engine not in ("mpm", "dem"):
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
        "volume",
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
