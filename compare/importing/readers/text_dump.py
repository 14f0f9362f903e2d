"""Grains of LAMMPS' and LIGGGHTS' text dumps, styles `custom` and `atom`.

Columns keep their names, except: x, y, z are made of xu, xs or xsu where they are not there
themselves (scaled by the box, triclinic too), and the radius of the diameter.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cases.errors import CaseError
from compare.importing import compressed
from compare.importing.dump import GRAINS, Instant, instants, label_of
from compare.importing.frame import Frame
from compare.importing.registry import HEAD, Reader, register

WHOLE = ("id", "type", "mol", "proc", "ix", "iy", "iz")  # columns of whole numbers
LARGEST = 2.0**53  # whole numbers up to it are exact in float64


def recognises(path: Path, head: bytes) -> bool:
    return is_binary(path, head) or label_of(head) in ("", GRAINS)


def is_binary(path: Path, head: bytes) -> bool:
    """LAMMPS' binary dumps: newer ones say so, older ones are known by their name."""
    told = head[8:32].startswith((b"DUMPATOM", b"DUMPCUSTOM"))
    return b"\0" in head and (told or ".bin" in path.suffixes)


def frames(path: Path, options: dict) -> Iterator[Frame]:
    if is_binary(path, compressed.head(path, HEAD)):
        raise CaseError(
            f"{path}: a binary dump of LAMMPS (text is read) turn it into text with LAMMPS' "
            "binary2txt, or dump to a name without .bin"
        )
    for instant in instants(path, options):
        if instant.label != GRAINS:
            raise CaseError(f"{path}:{instant.header}: rows of {instant.label} (no grains)")
        yield frame(path, instant)


def frame(path: Path, instant: Instant) -> Frame:
    columns = dict(instant.columns)
    columns |= positions(path, instant, columns)
    if "diameter" in columns:
        diameter = columns.pop("diameter")
        columns.setdefault("radius", 0.5 * diameter)
    for name in columns.keys() & set(WHOLE):
        columns[name] = whole(path, instant, name, columns[name])
    source = f"{path}:{instant.line}"
    return Frame(source, columns, instant.step, instant.time, instant.box, instant.units)


def positions(path: Path, instant: Instant, columns: dict) -> dict[str, np.ndarray]:
    """x, y, z of what the file has of them; takes out of `columns` what is used up."""
    missing = [
        axis for axis in "xyz" if not any(axis + form in columns for form in ("", "u", "s", "su"))
    ]
    if missing:
        if missing[0] in instant.names:
            raise CaseError(f"{path}:{instant.header + 1}: {missing[0]} is no number")
        raise CaseError(
            f"{path}:{instant.header}: no column {', '.join(missing)} (has "
            f"{', '.join(instant.names)})"
        )
    scaled = {
        axis: columns[form]
        for axis in "xyz"
        for form in (axis + "su", axis + "s")
        if form in columns
    }
    out = {}
    for axis in "xyz":
        if axis in columns:
            continue
        out[axis] = (
            columns[axis + "u"] if axis + "u" in columns else place(path, instant, scaled, axis)
        )
    for axis in out:
        for form in ("u", "s", "su"):
            columns.pop(axis + form, None)
    return out


def place(path: Path, instant: Instant, scaled: dict, axis: str) -> np.ndarray:
    """A coordinate of scaled ones: along the edges of the box, x of all three, y of y and z."""
    i, box = "xyz".index(axis), instant.box
    if box is None:
        raise CaseError(
            f"{path}:{instant.header}: scaled coordinates without a box (no 'ITEM: BOX BOUNDS')"
        )
    along = box.lower[i] + scaled[axis] * (box.upper[i] - box.lower[i])
    if box.tilt is None:
        return along
    xy, xz, yz = box.tilt
    for other, tilt in {"x": (("y", xy), ("z", xz)), "y": (("z", yz),), "z": ()}[axis]:
        if other not in scaled:
            raise CaseError(
                f"{path}:{instant.header}: {axis}s needs {other}s in a tilted box (has "
                f"{', '.join(instant.names)})"
            )
        along = along + scaled[other] * tilt
    return along


def whole(path: Path, instant: Instant, name: str, values: np.ndarray) -> np.ndarray:
    """A column of whole numbers as such."""
    with np.errstate(invalid="ignore"):
        wrong = np.flatnonzero(~((values == np.trunc(values)) & (np.abs(values) <= LARGEST)))
    if wrong.size:
        line = instant.header + 1 + wrong[0]
        raise CaseError(f"{path}:{line}: {values[wrong[0]]:.17g} is no whole number ({name})")
    return values.astype(np.int64)


READER = register(
    Reader(
        "text_dump",
        "LAMMPS or LIGGGHTS text dump (custom, atom)",
        "grains",
        recognises,
        frames,
    )
)
