"""Runs of either engine and the fields mapped from them, read from HDF5."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, overload

import numpy as np

from cases.case import Case, parse
from cases.errors import CaseError, EngineError
from cases.programs import call, program
from cases.reading import opened

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
    """The frames of a run file; each is read when it is asked for, the last one kept."""

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
        with opened(self.path) as f:
            cloud = f[f"data/{step}/particles/cloud"]
            moving = cloud["kind"][:] != GLUED if "kind" in cloud else slice(None)
            vector = {
                r: np.stack([cloud[r][k][:] for k in "xyz"], axis=-1)[moving]
                for r in ("position", "velocity")
            }
            mass = cloud["mass"][:][moving]
            state = {name: cloud[name][:] for name in POINT_STATE if name in cloud}
            if "stress" in cloud:
                normal = [cloud["stress"][name][:] for name in ("xx", "yy", "zz")]
                shear = [cloud["stress"][name][:] for name in ("xy", "yz", "zx")]
                state["pressure"] = sum(normal) / 3.0
                state["stress"] = np.sqrt(sum(s * s for s in [*normal, *shear, *shear]))
            if "dissipated" in cloud:
                state["dissipated"] = cloud["dissipated"][:][moving]
            elif DISSIPATION <= state.keys():
                state["dissipated"] = mass * sum(state[name] for name in DISSIPATION)
            return Cloud(
                vector["position"],
                vector["velocity"],
                mass,
                cloud["solid_volume"][:][moving],
                state,
            )


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


def seconds_of(run: Run, name: str) -> float:
    """An attribute of a run's file in seconds; NaN where the file does not tell it."""
    return float(run.attributes.get(name, np.nan))


def open_run(path: str | Path) -> Run:
    """The run of a result file; raises CaseError when it is not one."""
    path = Path(path)
    try:
        with opened(path) as f:
            attributes = {k: v.decode() if isinstance(v, bytes) else v for k, v in f.attrs.items()}
            steps = sorted(int(name) for name in f["data"])
            time = np.array([f[f"data/{step}"].attrs["time"] for step in steps])
            energy = {name: data[:] for name, data in f["energy"].items()}
    except CaseError:
        raise
    except (OSError, KeyError, ValueError) as error:
        raise CaseError(f"{path}: not a run of grainpair ({error})") from error
    if not steps:
        raise CaseError(f"{path}: no frames")
    if attributes["engine"] == "mpm" and REGIME not in energy:
        raise CaseError(
            f"{path}: energy/{REGIME} is missing (a file of another version of grainpair) run the "
            "case again"
        )
    return Run(
        path.stem,
        attributes["engine"],
        parse(attributes["case_resolved"], path),
        time,
        StoredClouds(path, steps),
        energy,
        attributes,
    )


def map_fields(runs: list[Path], output: Path, *options):
    """Calls grain_map; raises CaseError with its line where it refuses what it is given,
    EngineError when it fails.
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
    f = opened(path)
    grid = Grid(f["grid/x"][:], f["grid/y"][:], float(f["grid"].attrs["cell_volume"]))
    attributes = {k: v.decode() if isinstance(v, bytes) else v for k, v in f.attrs.items()}
    return Fields(grid, f[name]["time"][:], f[name], attributes)
