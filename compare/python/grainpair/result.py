"""The result file of one engine."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import overload

import h5py
import numpy as np
import pandas as pd

from cases import reading
from cases.case import Case, parse
from cases.errors import CaseError
from compare.mapping.clouds import SYMMETRIC, moving_of, open_grains

# Rows and columns of a tensor's components, in the order of SYMMETRIC.
PLACES = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))


class Result:
    """A file that one engine wrote, or that was imported.

    path; engine "mpm" or "dem"; attributes of the file by name, among them seed, command, commit,
    cpu_seconds_engine [s]; time (T,) of the frames [s], NaN where it is not told; frames, as many.
    """

    def __init__(self, path: Path):
        """Raises CaseError where `path` is no result file."""
        found = open_grains(path)
        self.path, self.engine, self.attributes = found.path, found.engine, dict(found.attributes)
        self.time: np.ndarray = found.time
        self.frames = Frames(self, found.clouds.steps)

    def __repr__(self) -> str:
        return f"<grainpair.Result {self.path}: {self.engine}, {len(self.frames)} frames>"

    @cached_property
    def case(self) -> Case:
        """The complete case: case["geometry.height"] is a value, in the units of the schema. Raises
        CaseError where the file has none, as imported grains may.
        """
        if "case_resolved" not in self.attributes:
            raise CaseError(f"{self.path}: has no case (give --case when importing it)")
        return parse(self.attributes["case_resolved"], self.path)

    @cached_property
    def history(self) -> pd.DataFrame:
        """The energies over time: an index `time` [s], a column for each account [J]; those that
        are dissipation are accumulated since the release. attrs["units"] and attrs["doc"] tell them
        by column.
        """
        with reading.result(self.path) as file:
            accounts = reading.group(file, "energy")
            names = ["time", *(name for name in accounts if name != "time")]
            values = reading.columns(accounts, names, unknown=names)
            told = {name: reading.attributes(accounts[name]) for name in names}
        out = pd.DataFrame(values).set_index("time")
        out.attrs["units"] = {name: one.get("unit", "") for name, one in told.items()}
        out.attrs["doc"] = {name: one.get("doc", "") for name, one in told.items()}
        return out


class Frames(Sequence["Frame"]):
    """The frames of a result, by number; the first is the instant of release."""

    def __init__(self, result: Result, steps: list[int]):
        self.result, self.steps = result, steps

    def __len__(self) -> int:
        return len(self.steps)

    @overload
    def __getitem__(self, i: int) -> "Frame":
        ...

    @overload
    def __getitem__(self, i: slice) -> list["Frame"]:
        ...

    def __getitem__(self, i):
        if isinstance(i, slice):
            return [self[k] for k in range(*i.indices(len(self)))]
        return Frame(self.result.path, self.steps[i], float(self.result.time[i]))


@dataclass(frozen=True)
class Frame:
    """What there is at one instant: frame["velocity"] is an array of a row for each particle, in
    the order of frame["id"].

    A scalar record is (N,), a vector (N, 3) of x, y, z, a tensor (N, 3, 3), stress with compression
    positive. Which there are says `records`, their units `unit`; CONTRIBUTING.md lists them all.
    """

    path: Path
    step: int
    time: float  # [s]

    def _group(self, file: h5py.File, place: str) -> h5py.Group:
        return reading.group(file, f"data/{self.step}/{place}")

    @cached_property
    def records(self) -> tuple[str, ...]:
        """Names of the records."""
        with reading.result(self.path) as file:
            return tuple(self._group(file, "particles/cloud"))

    def __contains__(self, name: str) -> bool:
        return name in self.records

    def __iter__(self) -> Iterator[str]:
        return iter(self.records)

    def __getitem__(self, name: str) -> np.ndarray:
        """The numbers of a record. Raises CaseError where there is none of that name, or one of
        them is not finite.
        """
        with reading.result(self.path) as file:
            cloud = self._group(file, "particles/cloud")
            return record(cloud, name, reading.length(cloud, "mass"))

    def unit(self, name: str) -> str:
        """Of a record, such as "m/s"; "" where the file does not tell it."""
        with reading.result(self.path) as file:
            cloud = self._group(file, "particles/cloud")
            found = cloud.get(name)
            if found is None:
                raise missing(cloud, name)
            first = found[next(iter(found))] if component_names(found) else found
            return str(reading.plain(first.attrs.get("unit", "")))

    @cached_property
    def moving(self) -> np.ndarray:
        """Which particles (N,) move: all but the glued grains of a wall."""
        with reading.result(self.path) as file:
            cloud = self._group(file, "particles/cloud")
            return moving_of(cloud, reading.length(cloud, "mass"))

    @cached_property
    def contacts(self) -> "Contacts | None":
        """Of the grains, where they were written (output.contacts)."""
        with reading.result(self.path) as file:
            if "contacts" not in self._group(file, ""):
                return None
            told = self._group(file, "contacts")
            rows = reading.length(told, "first")
            return Contacts(
                reading.values(told, "first", rows),
                reading.values(told, "second", rows),
                reading.vectors(told, "branch", rows),
                reading.vectors(told, "position", rows),
                reading.vectors(told, "force", rows),
                reading.values(told, "dissipation", rows) if "dissipation" in told else None,
            )


@dataclass(frozen=True)
class Contacts:
    """Contacts of one frame, a row each."""

    first: np.ndarray  # (C,) ids of grains
    second: np.ndarray  # (C,) the same, or -1 left wall, -2 gate, -3 floor, -4 front, -5 back
    branch: np.ndarray  # (C, 3) centre of first minus centre of second, or minus the point [m]
    position: np.ndarray  # (C, 3) contact point [m]
    force: np.ndarray  # (C, 3) on first [N]
    dissipation: np.ndarray | None  # (C,) [W], where it is known

    def __len__(self) -> int:
        return len(self.first)


def component_names(found: h5py.HLObject) -> tuple[str, ...]:
    """The components of a record; none of a scalar one, stored or constant."""
    if isinstance(found, h5py.Dataset) or "value" in found.attrs:
        return ()
    return tuple(found)


def record(cloud: h5py.Group, name: str, rows: int) -> np.ndarray:
    """A record (N,), (N, 3) or (N, 3, 3) of a frame's particles."""
    if name not in cloud:
        raise missing(cloud, name)
    names = component_names(cloud[name])
    if not names:
        return reading.values(cloud, name, rows)
    if set(names) == set("xyz"):
        return reading.vectors(cloud, name, rows)
    out = np.empty((rows, 3, 3))
    for component, (i, j) in zip(SYMMETRIC, PLACES):
        out[:, i, j] = out[:, j, i] = reading.values(cloud, f"{name}/{component}", rows)
    return out


def missing(cloud: h5py.Group, name: str) -> CaseError:
    there = ", ".join(sorted(cloud))
    return CaseError(f"{reading.where(cloud)}: no record {name} (there are {there})")
