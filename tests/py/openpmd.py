"""What openPMD 1.1.0 asks of a file of particles, and where a file does not do so.

Written from the text of the standard (STANDARD.md of github.com/openPMD/openPMD-standard, tag
1.1.0). Not held, as our files have none: meshes, extensions, particlePatches.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

REQUIRED = {
    "openPMD": r"\d+\.\d+\.\d+",
    "basePath": r"/data/%T/",
    "iterationEncoding": r"groupBased",  # or in files, which ours never are
    "iterationFormat": r"/data/%T/",  # of groupBased: the basePath
}
OTHER = {
    "particlesPath": r"([^/]+/)+",
    "meshesPath": r"([^/]+/)+",
    "author": r".+",
    "software": r".+",
    "softwareVersion": r".+",
    "date": r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d [+-]\d{4}",
    "softwareDependencies": r".*",
    "machine": r".+",
    "comment": r".*",
}
FLOATS = (np.float16, np.float32, np.float64, np.longdouble)


def violations(path: Path) -> list[str]:
    """One line for each, which begins with where it is."""
    with h5py.File(path) as file:
        found = [*texts(file), *root(file)]
        iterations = file.get("data")
        if not isinstance(iterations, h5py.Group) or not len(iterations):
            return [*found, "/data: no iterations"]
        for name, frame in iterations.items():
            found += iteration(file, name, frame)
        return found


def texts(file: h5py.File) -> Iterator[str]:
    """Text is of fixed length, wherever it stands."""

    def look(name: str, thing) -> None:
        for key in thing.attrs:
            info = h5py.check_string_dtype(thing.attrs.get_id(key).dtype)
            if info and info.length is None:
                found.append(f"{thing.name}@{key}: text of variable length")

    found: list[str] = []
    look("/", file)
    file.visititems(look)
    yield from found


def root(file: h5py.File) -> Iterator[str]:
    for name, form in {**REQUIRED, **OTHER}.items():
        if name not in file.attrs:
            if name in REQUIRED:
                yield f"/@{name}: missing"
            continue
        value = file.attrs[name]
        if not isinstance(value, bytes) or not value.isascii():
            yield f"/@{name}: no ASCII text"
        elif not re.fullmatch(form, value.decode(), re.ASCII):
            yield f"/@{name}: {bytes(value)!r} is not of the form {form}"
    if type(file.attrs.get("openPMDextension")) is not np.uint32:
        yield "/@openPMDextension: no uint32"


def iteration(file: h5py.File, name: str, frame: h5py.Group) -> Iterator[str]:
    if not re.fullmatch(r"\d+", name, re.ASCII) or int(name) >= 2**64:
        yield f"/data/{name}: no unsigned integer"
    for key in ("time", "dt"):
        if not isinstance(frame.attrs.get(key), FLOATS):
            yield f"{frame.name}@{key}: no float"
    if type(frame.attrs.get("timeUnitSI")) is not np.float64:
        yield f"{frame.name}@timeUnitSI: no float64"
    for key in ("particlesPath", "meshesPath"):
        path = file.attrs.get(key, b"")
        inside = path.decode() if isinstance(path, bytes) else str(path)
        if inside and not isinstance(frame.get(inside), h5py.Group):
            yield f"{frame.name}/{inside}: named by {key}, but missing"
        elif inside and key == "particlesPath":
            for species in frame[inside].values():
                yield from particles(species)


def particles(species: h5py.Group) -> Iterator[str]:
    """Records of one length, position and its offset among them."""
    lengths, parts = set(), {}
    for name, record in species.items():
        if not re.fullmatch(r"\w+", name, re.ASCII):
            yield f"{record.name}: name with other characters than a-Z, 0-9, _"
        powers = record.attrs.get("unitDimension")
        if not isinstance(powers, np.ndarray) or (powers.dtype, powers.shape) != (float, (7,)):
            yield f"{record.name}@unitDimension: not 7 float64"
        if not isinstance(record.attrs.get("timeOffset"), FLOATS):
            yield f"{record.name}@timeOffset: no float"
        scalar = isinstance(record, h5py.Dataset) or "value" in record.attrs
        parts[name] = {"": record} if scalar else dict(record.items())
        for key, part in parts[name].items():
            if key and not re.fullmatch(r"\w+", key, re.ASCII):
                yield f"{part.name}: name with other characters than a-Z, 0-9, _"
            lengths.add(length(part))
            yield from component(part)
    if len(lengths) > 1:
        yield f"{species.name}: records of different length {sorted(lengths)}"
    for name in ("position", "positionOffset"):
        if name not in parts:
            yield f"{species.name}/{name}: missing"
        elif parts[name].keys() != parts.get("position", {}).keys():
            yield f"{species.name}/{name}: other components than position"
    if "id" in parts and parts["id"][""].dtype != np.uint64:
        yield f"{species.name}/id: no uint64"


def component(part) -> Iterator[str]:
    if type(part.attrs.get("unitSI")) is not np.float64:
        yield f"{part.name}@unitSI: no float64"
    if isinstance(part, h5py.Dataset):
        if part.ndim != 1:
            yield f"{part.name}: of {part.ndim} dimensions"
        return
    shape = part.attrs.get("shape")
    if "value" not in part.attrs:
        yield f"{part.name}: a group without value is no constant component"
    if not isinstance(shape, np.ndarray) or (shape.dtype, shape.shape) != (np.uint64, (1,)):
        yield f"{part.name}@shape: not one uint64"
    if len(part):
        yield f"{part.name}: a constant component that is not empty"


def length(part) -> int:
    """Of a component; -1 where it has none."""
    shape = part.shape if isinstance(part, h5py.Dataset) else part.attrs.get("shape", ())
    return int(np.ravel(shape)[0]) if np.size(shape) else -1
