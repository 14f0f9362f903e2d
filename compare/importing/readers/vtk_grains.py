"""Grains of VTK files, a point each: LIGGGHTS' `dump custom/vtk` (legacy, .vtp, .vtu), YADE's
VTKRecorder and others of their kind; a .pvd tells the times of several.

Vectors become columns of their components (v: vx, vy, vz). The step is the number that a file's
name ends with, unless the file tells it. Beside the grains LIGGGHTS writes the box, as a file
…_boundingBox_…: it is taken from there, and passed over where it is named as an input.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cases.errors import CaseError
from compare.importing import compressed, vtk_legacy, vtk_xml
from compare.importing.dump import UNTOLD
from compare.importing.frame import Box, Frame, note
from compare.importing.lines import Incomplete, drop
from compare.importing.registry import Reader, register
from compare.importing.vtk_legacy import Cloud

BOX = "boundingBox_"
# Names of other programs, in small letters, and ours.
SCALARS = {"radii": "radius", "ids": "id", "particleid": "id", "speciestype": "type"}
VECTORS = {
    "velocity": "v",
    "vel": "v",
    "linvelvec": "v",
    "angularvelocity": "omega",
    "angular_velocity": "omega",
    "angvelvec": "omega",
    "force": "f",
}
OURS = ("id", "type", "radius", "diameter", "mass", "density", "volume", "v", "omega", "f")
TIMES, STEPS = ("timevalue", "time"), ("timestep", "cycle", "step")


def recognises(path: Path, head: bytes) -> bool:
    return head.startswith(vtk_legacy.MAGIC) or vtk_xml.MARK in head[:1024]


def frames(path: Path, options: dict) -> Iterator[Frame]:
    data = content(path)
    try:
        listed = None if is_legacy(data) else vtk_xml.collection(path, data)
        alone: list[tuple[float | None, Path]] = [(None, path)]
        for time, file in alone if listed is None else listed:
            data = content(file) if listed is not None else data
            cloud = read(file, data)
            if cloud.corners is not None and BOX in file.name:
                note(options, f"files named …{BOX}… hold the box alone")
                continue
            if is_legacy(data) and not cloud.arrays and len(cloud.points):
                note(options, f"passed over: {file} has no arrays at its points (a mesh?)")
                continue
            one = frame(file, cloud, options)
            one.time = one.time if time is None else time
            yield one
    except Incomplete as error:
        drop(error, options)


def content(path: Path) -> bytes:
    with compressed.opened(path) as file:
        return file.read()


def is_legacy(data: bytes) -> bool:
    return data.startswith(vtk_legacy.MAGIC)


def read(path: Path, data: bytes) -> Cloud:
    return (vtk_legacy if is_legacy(data) else vtk_xml).read(path, data)


def frame(path: Path, cloud: Cloud, options: dict) -> Frame:
    if cloud.kind.lower().replace("_", "") not in ("polydata", "unstructuredgrid"):
        raise CaseError(f"{path}: {cloud.kind} holds no grains (polydata, unstructured grids do)")
    columns = dict(zip("xyz", doubles(cloud.points).T))
    for name, values in cloud.arrays.items():
        if len(values) != len(cloud.points):
            raise CaseError(f"{path}: {len(values)} values of {name}, {len(cloud.points)} points")
        for column, component in components(name, values):
            columns.setdefault(column, component)
    if "diameter" in columns:
        diameter = columns.pop("diameter")
        columns.setdefault("radius", 0.5 * diameter)
    for name in {"id", "type"} & columns.keys():
        values = columns[name]
        if (
            not np.array_equal(values, np.trunc(values))
            or np.abs(values).max(initial=0) > 2.0**53
        ):
            raise CaseError(f"{path}: {name} is not all whole numbers")
        columns[name] = values.astype(np.int64)
    told = {name.lower(): values.ravel() for name, values in cloud.whole.items() if values.size}
    time = next((float(told[name][0]) for name in TIMES if name in told), None)
    step = next((int(told[name][0]) for name in STEPS if name in told), step_of(path))
    return Frame(str(path), columns, step, time, box_of(path, options))


def components(name: str, values: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """The columns of an array, by our names where they are known."""
    lower = name.lower().replace(" ", "")
    values = doubles(values)
    if values.ndim == 1:
        known = SCALARS.get(lower, lower)
        yield known if known in OURS else name, values
    elif values.shape[1] == 3:
        known = VECTORS.get(lower, lower)
        for axis, component in zip("xyz", values.T):
            yield (known if known in OURS else name) + axis, component.copy()
    else:
        for number, component in enumerate(values.T, start=1):
            yield f"{name}[{number}]", component.copy()


def doubles(values: np.ndarray) -> np.ndarray:
    with np.errstate(invalid="ignore"):  # a signalling NaN is refused later, with its grain
        return values.astype(np.float64)


def step_of(path: Path) -> int | None:
    """The number that a file's name ends with."""
    found = re.search(r"(\d+)(\.(vtk|vtp|vtu|pvtp|pvtu|gz|zst))*$", path.name)
    return int(found[1]) if found else None


def box_of(path: Path, options: dict) -> Box | None:
    """The box that LIGGGHTS wrote beside the grains, which does not tell its boundaries."""
    found = re.fullmatch(r"(.*?)(\d+)\.(vtk|vtp|vtu)", path.name)
    if not found:
        return None
    beside = path.with_name(f"{found[1]}{BOX}{found[2]}.{'vtk' if found[3] == 'vtk' else 'vtr'}")
    if not beside.is_file():
        return None
    try:
        corners = read(beside, content(beside)).corners
    except CaseError:
        corners = None
    if corners is None:
        note(options, f"{beside}: the box cannot be read, and is left out")
        return None
    note(options, UNTOLD)
    return Box(corners[0], corners[1], np.zeros(3, bool), np.zeros((3, 2), bool))


READER = register(
    Reader(
        "vtk_grains",
        "VTK points as grains (LIGGGHTS custom/vtk, YADE VTKRecorder, …)",
        "grains",
        recognises,
        frames,
    )
)
