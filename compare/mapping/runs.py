"""Runs of either engine and the fields mapped from them, read from HDF5."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np

from cases import reading
from cases.case import Case, parse
from cases.errors import CaseError, EngineError
from cases.programs import call, program
from compare.mapping.clouds import Cloud, open_grains

if TYPE_CHECKING:
    from compare.mapping.dissipation import InPlace


@dataclass(frozen=True)
class Grid:
    """Centres x (nx,) and y (ny,) [m] of the cells that fields of shape (ny, nx) belong to;
    cell_volume [m3], of rings (nx,). `angle` [rad]: about an axis x is the radius, and cells are
    rings of a sector that wide; 0 in a plane.
    """

    x: np.ndarray
    y: np.ndarray
    cell_volume: float | np.ndarray
    angle: float = 0.0

    @property
    def spacing(self) -> float:
        axis = self.x if len(self.x) > 1 else self.y  # a profile has one x
        return axis[1] - axis[0]

    def integral(self, field: np.ndarray) -> np.ndarray:
        """Of a field (..., ny, nx) over the cells."""
        if self.angle:
            return (field * self.cell_volume).sum(axis=(-2, -1))
        return field.sum(axis=(-2, -1)) * self.cell_volume


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

    def at(self, name: str, frame: int, x: np.ndarray) -> np.ndarray:
        """A scalar field (N,) of the cells that places x (N, 3) [m] lie in; NaN off the grid."""
        grid = self.grid
        along = np.hypot(x[:, 0], x[:, 2]) if grid.angle else x[:, 0]
        column = np.rint((along - grid.x[0]) / grid.spacing).astype(int)
        row = np.rint((x[:, 1] - grid.y[0]) / grid.spacing).astype(int)
        inside = (row >= 0) & (row < len(grid.y)) & (column >= 0) & (column < len(grid.x))
        values = np.full(len(x), np.nan)
        values[inside] = self[name][frame][row[inside], column[inside]]
        return values


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
    grain: float | None = None  # diameter [m] that both sides of a pair are measured by

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
        """[m]: of a pair, else the file's own (d43 of its grains), else the case's."""
        return self.grain or float(self.attributes.get("diameter", self.case["grains.diameter"]))

    @property
    def imported(self) -> bool:
        """Whether grains or points are those of another program."""
        return "source" in self.attributes or self.attributes.get("engine_version") == "dumps"

    @property
    def notes(self) -> list[str]:
        """What was assumed, merged, dropped, disagrees when the grains were imported."""
        told = str(self.attributes.get("notes", "none")).splitlines()
        return [] if told == ["none"] else told

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
        """A column of the energy history, scaled by mass [J]; zero where the engine has none, not a
        number where points of another program do not tell it.
        """
        none = np.nan if self.imported and self.engine == "mpm" else 0.0
        return self.mass_scale * self.energy.get(name, np.full_like(self.energy["time"], none))

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
        """Potential energy at release minus that at the end [J], that of grains that vanished left
        out; NaN where there is one instant.
        """
        if len(self.energy["time"]) < 2:
            return float("nan")
        potential = self.joules("potential") + self.joules("lost_potential")
        return float(potential[0] - potential[-1])


REGIME = "dissipated_regime_4"  # without it a budget would have a hole that looks like zero
UNKNOWN = ("unaccounted",)  # accounts that are NaN where nobody audited them
SCENE = (  # what both sides of a pair share
    "geometry.height",
    "geometry.length",
    "geometry.thickness",
    "geometry.gravity",
    "grains.diameter",
    "grains.density",
)
# About an axis the grains are a quarter of a cylinder; points are whole circles, of which what is
# compared is a quarter too.
SECTOR = {"dem": 1.0, "mpm": 4.0}
POSITIVE = (*SCENE, "compare.width", "compare.spacing")


def seconds_of(run: Run, name: str) -> float:
    """An attribute of a run's file in seconds; NaN where the file does not tell it."""
    return float(run.attributes.get(name, np.nan))


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
    if about_axis(scene):
        found.clouds.sector = SECTOR[engine]
        energy = {k: v if k == "time" else v / SECTOR[engine] for k, v in energy.items()}
    return Run(path.stem, engine, scene, found.time, found.clouds, energy, told)


def about_axis(scene: Case) -> bool:
    """Whether x is a radius."""
    return scene.values["geometry"].get("dimension") == "axisymmetric"


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


def grid_of(group: h5py.Group) -> Grid:
    x, y = group["x"][:], group["y"][:]
    if "angle" not in group.attrs:
        return Grid(x, y, float(group.attrs["cell_volume"]))
    angle = float(group.attrs["angle"])
    return Grid(x, y, angle * x * (x[1] - x[0]) * (y[1] - y[0]), angle)


def open_fields(path: str | Path, name: str) -> Fields:
    """Fields of the run `name` in a file of grain_map."""
    f = reading.opened(path)
    return Fields(grid_of(f["grid"]), f[name]["time"][:], f[name], reading.attributes(f))
