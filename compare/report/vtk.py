"""Frames of a run as .vtu files and the .pvd that lists them with their times, for ParaView.

Particles are points, contacts lines. ParaView's colours need ranges that hold for all frames of all
files, which are gathered on the way (Seen).
"""

import re
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import h5py
import meshio
import numpy as np
from scipy.spatial import cKDTree

from cases import reading
from cases.errors import CaseError
from cases.scratch import scratch
from compare.mapping.clouds import GLUED, SYMMETRIC, StoredClouds, open_grains
from compare.mapping.runs import Fields, open_fields

OMITTED = {"position", "positionOffset"}  # the first are the points, the second is zero
MAPPED = ("void_ratio", "granular_temperature")  # fields that particles are given, as mapped_…
# Quantiles of what is mapped that colours span: at the surface the void ratio has no bound.
SHARE = (0.05, 0.95)
RANGED = ("velocity", *(f"mapped_{name}" for name in MAPPED))


NO_XML = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")


@dataclass
class Seen:
    """What all frames of a file have between them: lowest and highest (`ranges`) of RANGED (of
    velocity, of its magnitude), of radii and of the places of what moves; the largest force of a
    contact [N]; the `radius` to draw a particle with, where the file gives it none [m].
    """

    ranges: dict[str, tuple] = field(default_factory=dict)
    force: float = 0.0
    radius: float = 0.0

    def see(self, name: str, values: np.ndarray):
        if len(values):
            low, high = values.min(axis=0), values.max(axis=0)
            before = self.ranges.get(name, (low, high))
            self.ranges[name] = np.minimum(before[0], low), np.maximum(before[1], high)


@dataclass(frozen=True)
class Exported:
    """The .pvd of the particles, that of the contacts where the file has any, and what was seen."""

    particles: Path
    contacts: Path | None
    seen: Seen


class Series:
    """The frames of one .pvd, which are gathered in `work` until they are moved to `folder`."""

    def __init__(self, work: Path, name: str):
        self.work, self.name, self.count = work, name, 0
        self.listing = ElementTree.Element("VTKFile", type="Collection", version="0.1")
        self.collection = ElementTree.SubElement(self.listing, "Collection")
        (work / name).mkdir()

    def add(self, mesh: meshio.Mesh, step: int, time: float):
        mesh.write(self.work / self.name / f"{step}.vtu")
        told = {"timestep": repr(float(time)), "part": "0", "file": f"{self.name}/{step}.vtu"}
        ElementTree.SubElement(self.collection, "DataSet", told)
        self.count += 1

    def move(self, folder: Path) -> Path | None:
        """Takes the place of what was there; the .pvd, None where there are no frames."""
        target = folder / f"{self.name}.pvd"
        shutil.rmtree(folder / self.name, ignore_errors=True)
        target.unlink(missing_ok=True)
        if not self.count:
            return None
        ElementTree.ElementTree(self.listing).write(
            self.work / "all.pvd", xml_declaration=True, encoding="utf-8"
        )
        (self.work / self.name).rename(folder / self.name)
        return (self.work / "all.pvd").rename(target)


def export(run: Path, folder: Path) -> Exported:
    """Writes `folder`/<run>.pvd and `folder`/<run>/<step>.vtu of the particles, and the same of
    <run>_contacts.

    Each record of CONTRIBUTING.md becomes point data of its name, SI units: a vector (N, 3), a
    symmetric tensor (N, 6) in the order xx yy zz xy yz zx; of contacts cell data. Where a fields.h5
    beside the run holds it, particles have the mapped fields of MAPPED too. Raises CaseError if
    `run` is no result file. Nothing is left of a failed export.
    """
    if NO_XML.search(run.stem):
        raise CaseError(f"{run}: cannot be exported (XML holds no such name) rename it")
    folder.mkdir(parents=True, exist_ok=True)
    with scratch(folder, run.stem) as work:
        found, seen = open_grains(run), Seen()
        particles, contacts = (Series(work, f"{run.stem}{end}") for end in ("", "_contacts"))
        fields = fields_of(run, found.time)
        for k, (step, frame) in enumerate(frames(found.clouds)):
            time = float(found.time[k]) if np.isfinite(found.time[k]) else float(step)
            points = mesh(reading.group(frame, "particles/cloud"))
            if fields:
                for name in (name for name in MAPPED if name in fields):
                    points.point_data[f"mapped_{name}"] = fields.at(name, k, points.points)
            particles.add(points, step, time)
            look(points, seen)
            if "contacts" in frame:
                drawn = lines(frame)
                contacts.add(drawn, step, time)
                largest = drawn.cell_data["force_magnitude"][0].max(initial=0.0)
                seen.force = max(seen.force, float(largest))
        listing = particles.move(folder)
        assert listing
        return Exported(listing, contacts.move(folder), seen)


def frames(clouds: StoredClouds) -> Iterator[tuple[int, h5py.Group]]:
    with reading.result(clouds.path) as file:
        for step in clouds.steps:
            yield step, reading.group(file, f"data/{step}")


def mesh(cloud: h5py.Group) -> meshio.Mesh:
    """A cloud as one vertex cell per particle."""
    points = reading.vectors(cloud, "position")
    count = len(points)

    def values(name: str) -> np.ndarray:
        record = cloud[name]
        if isinstance(record, h5py.Dataset) or "value" in record.attrs:
            return reading.values(cloud, name, count, finite=False)
        order = ("x", "y", "z") if "x" in record else SYMMETRIC
        parts = [reading.values(cloud, f"{name}/{part}", count, finite=False) for part in order]
        return np.column_stack(parts)

    return meshio.Mesh(
        points,
        [("vertex", np.arange(count)[:, None])],
        point_data={name: values(name) for name in cloud if name not in OMITTED},
    )


def lines(frame: h5py.Group) -> meshio.Mesh:
    """Contacts as lines from the centre of the first grain to that of the second, or to the contact
    point at a wall. A partner across a periodic face is drawn at its nearest image, so that no line
    crosses the domain. Cell data: force (on the first), its magnitude, first, second, and
    dissipation where it is known.
    """
    cloud, contacts = reading.group(frame, "particles/cloud"), reading.group(frame, "contacts")
    ids, centres = reading.values(cloud, "id"), reading.vectors(cloud, "position")
    first = reading.values(contacts, "first")
    order = np.argsort(ids)
    rows = np.searchsorted(ids, first, sorter=order)
    if len(first) and (rows.max() == len(ids) or np.any(ids[order[rows]] != first)):
        raise CaseError(f"{reading.where(contacts)}: of grains that are not in their frame")
    start = centres[order[rows]]
    end = start - reading.vectors(contacts, "branch", len(first))
    force = reading.vectors(contacts, "force", len(first))
    data = {
        "force": force,
        "force_magnitude": np.linalg.norm(force, axis=1),
        "first": first,
        "second": reading.values(contacts, "second", len(first)),
    }
    if "dissipation" in contacts:
        data["dissipation"] = reading.values(contacts, "dissipation", len(first), finite=False)
    return meshio.Mesh(
        np.stack([start, end], axis=1).reshape(-1, 3),  # each line has its own ends
        [("line", np.arange(2 * len(first)).reshape(-1, 2))],
        cell_data={name: [values] for name, values in data.items()},
    )


def fields_of(run: Path, time: np.ndarray) -> Fields | None:
    """The fields mapped from a run, if a fields.h5 beside it holds them frame by frame."""
    path = run.with_name("fields.h5")
    if not path.is_file():
        return None
    with reading.result(path) as file:
        if run.stem not in file or set(reading.group(file, "grid")) != {"x", "y"}:
            return None
        known = [name for name in MAPPED if name in file[run.stem]]
    fields = open_fields(path, run.stem)
    return fields if known and np.array_equal(fields.time, time) else None


def look(points: meshio.Mesh, seen: Seen):
    """Takes a frame's particles into what was seen."""
    kind = points.point_data.get("kind", np.zeros(len(points.points)))
    seen.see("position", points.points[kind != GLUED])
    for name in RANGED:
        if name in points.point_data:
            values = points.point_data[name]
            if values.ndim == 2:
                seen.see(name, np.linalg.norm(values, axis=1))
            elif np.any(known := np.isfinite(values)):
                seen.see(name, np.quantile(values[known], SHARE))
    if "radius" in points.point_data:
        seen.see("radius", points.point_data["radius"])
    elif not seen.radius and len(points.points) > 1:
        nearest = cKDTree(points.points).query(points.points, k=2)[0][:, 1]
        seen.radius = 0.5 * float(np.median(nearest))
