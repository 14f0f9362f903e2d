"""VTK's legacy format, text or binary, versions 1 to 5.1: the points and their arrays.

meshio reads no polydata of it, which LIGGGHTS writes. [VTK file formats, docs.vtk.org]
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cases.errors import CaseError
from compare.importing.lines import Incomplete

MAGIC = b"# vtk DataFile"
# Types by their names, big-endian where binary.
TYPES = {
    "unsigned_char": ">u1",
    "char": ">i1",
    "unsigned_short": ">u2",
    "short": ">i2",
    "unsigned_int": ">u4",
    "int": ">i4",
    "unsigned_long": ">u8",
    "long": ">i8",
    "float": ">f4",
    "double": ">f8",
    "vtkidtype": ">i4",
    "vtktypeint64": ">i8",
    "vtktypeuint64": ">u8",
    "vtktypeint32": ">i4",
    "vtktypeuint32": ">u4",
}
CELLS = ("VERTICES", "LINES", "POLYGONS", "TRIANGLE_STRIPS", "CELLS")
AXES = ("X_COORDINATES", "Y_COORDINATES", "Z_COORDINATES")
COMPONENTS = {"VECTORS": 3, "NORMALS": 3, "TENSORS": 9, "TENSORS6": 6}
IDS = ("GLOBAL_IDS", "PEDIGREE_IDS")


@dataclass
class Cloud:
    """What a VTK file holds: points (N, 3), arrays at them, (N,) or (N, components), and arrays of
    the whole; `kind` of the data set. Of a rectilinear grid `corners` are (2, 3).
    """

    kind: str
    points: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    arrays: dict[str, np.ndarray] = field(default_factory=dict)
    whole: dict[str, np.ndarray] = field(default_factory=dict)
    corners: np.ndarray | None = None


class Cursor:
    """A place in the bytes of a file."""

    def __init__(self, path: Path, data: bytes):
        self.path, self.data, self.at, self.text = path, data, 0, True

    def where(self) -> str:
        """The file, and its line where lines can be counted."""
        lines = self.data.count(b"\n", 0, self.at)
        return f"{self.path}:{lines}" if self.text else f"{self.path}"

    def line(self) -> str | None:
        """The next line that is not blank."""
        while self.at < len(self.data):
            end = self.data.find(b"\n", self.at)
            end = len(self.data) if end < 0 else end
            line, self.at = self.data[self.at : end].decode("latin-1").strip(), end + 1
            if line:
                return line
        return None

    def need(self, what: str) -> str:
        line = self.line()
        if line is None:
            raise Incomplete(f"{self.where()}: the file ends here, {what} is missing (cut short?)")
        return line

    def values(self, count: int, kind: str, what: str) -> np.ndarray:
        """The next `count` numbers, (count,)."""
        name = kind.lower()
        if name not in TYPES or count < 0:
            raise CaseError(f"{self.where()}: {what} of type {kind}, {count} times (not known)")
        dtype = np.dtype(TYPES[name])
        if not self.text:
            stop = self.at + count * dtype.itemsize
            if stop > len(self.data):
                raise self.short(what)
            block, self.at = self.data[self.at : stop], stop
            return np.frombuffer(block, dtype).astype(dtype.newbyteorder("="))
        words = self.words(count, what)
        try:
            return np.array(words, dtype=np.float64 if dtype.kind == "f" else np.int64)
        except (ValueError, OverflowError) as error:
            raise CaseError(f"{self.where()}: {what} is not all numbers ({error})") from None

    def words(self, count: int, what: str) -> list[bytes]:
        """The next `count` words, to the end of a line."""
        words: list[bytes] = []
        while len(words) < count:
            if self.at >= len(self.data):
                raise self.short(what)
            end = self.data.find(b"\n", self.at)
            stop = len(self.data) if end < 0 else end
            words += self.data[self.at : stop].split()
            if end < 0 and len(words) >= count and not self.data[-1:].isspace():
                raise self.short(f"the last number of {what}", "? if it is whole, end its line")
            self.at = stop + 1
        if len(words) > count:
            raise CaseError(f"{self.where()}: {what} does not end a line with its number {count}")
        return words

    def short(self, what: str, why: str = "?") -> Incomplete:
        self.at = len(self.data)
        return Incomplete(f"{self.where()}: the file ends within {what} (cut short{why})")


def read(path: Path, data: bytes) -> Cloud:
    """Reads a file; raises CaseError where it is not as it should be."""
    cursor = Cursor(path, data)
    try:
        return sections(cursor)
    except (IndexError, ValueError) as error:  # words missing in a line, words that are no numbers
        raise CaseError(f"{cursor.where()}: a line that cannot be read ({error})") from error


def sections(cursor: Cursor) -> Cloud:
    head = cursor.data[: cursor.data.find(b"\n") + 1].decode("latin-1").split()
    if not cursor.data.startswith(MAGIC) or len(head) < 5:
        raise CaseError(f"{cursor.path}:1: no legacy VTK file (starts with {head[:4]})")
    version = float(head[4])
    cursor.at = cursor.data.find(b"\n") + 1
    cursor.at = cursor.data.find(b"\n", cursor.at) + 1  # the title, which may be blank
    form = cursor.need("ASCII or BINARY").upper()
    if form not in ("ASCII", "BINARY"):
        raise CaseError(f"{cursor.where()}: {form[:20]!r} where ASCII or BINARY should be")
    cursor.text = form == "ASCII"
    cloud: Cloud | None = None
    target: dict[str, np.ndarray] = {}
    whole: dict[str, np.ndarray] = {}
    count, corners = 0, []
    while (line := cursor.line()) is not None:
        words = line.split()
        key = words[0].upper()
        if key == "DATASET":
            cloud = Cloud(words[1].upper(), whole=whole)
        elif key == "METADATA":
            skip_metadata(cursor)
        elif key == "FIELD":
            fields(cursor, int(words[2]), whole if cloud is None or not count else target)
        elif cloud is None:
            raise CaseError(f"{cursor.where()}: {line[:40]!r} before DATASET")
        elif key == "POINTS":
            cloud.points = cursor.values(3 * int(words[1]), words[2], "POINTS").reshape(-1, 3)
        elif key in AXES:
            axis = cursor.values(int(words[1]), words[2], key)
            corners.append((axis.min(), axis.max()))
        elif key in CELLS:
            cells(cursor, words, version)
        elif key == "CELL_TYPES":
            cursor.values(int(words[1]), "int", key)
        elif key in ("POINT_DATA", "CELL_DATA"):
            count, target = int(words[1]), cloud.arrays if key == "POINT_DATA" else {}
        elif key not in ("DIMENSIONS", "ORIGIN", "SPACING"):
            attribute(cursor, key, words, count, target)
    if cloud is None:
        raise Incomplete(f"{cursor.where()}: no DATASET (cut short?)")
    if len(corners) == 3:
        cloud.corners = np.array(corners).T
    return cloud


def skip_metadata(cursor: Cursor) -> None:
    """To the blank line that ends it."""
    end = cursor.data.find(b"\n\n", cursor.at)
    cursor.at = len(cursor.data) if end < 0 else end + 2


def cells(cursor: Cursor, words: list[str], version: float) -> None:
    """Passes over which points make up cells."""
    what, count, size = words[0], int(words[1]), int(words[2])
    if version < 5.0:
        cursor.values(size, "int", what)
        return
    for name, length in (("OFFSETS", count), ("CONNECTIVITY", size)):
        line = cursor.need(f"{name} of {what}").split()
        if line[0].upper() != name:
            raise CaseError(f"{cursor.where()}: {line[0][:40]!r} where {name} should be")
        cursor.values(length, line[1], f"{name} of {what}")


def fields(cursor: Cursor, count: int, target: dict[str, np.ndarray]) -> None:
    for i in range(count):
        line = cursor.need(f"array {i + 1} of {count}").split()
        while line[0].upper() == "METADATA":
            skip_metadata(cursor)
            line = cursor.need(f"array {i + 1} of {count}").split()
        name, components, tuples, kind = line[0], int(line[1]), int(line[2]), line[3]
        if kind.lower() == "string" and cursor.text:
            cursor.words(components * tuples, name)  # names of elements
            continue
        values = cursor.values(components * tuples, kind, name)
        target[name] = values if components == 1 else values.reshape(tuples, components)


def attribute(
    cursor: Cursor, key: str, words: list[str], count: int, target: dict[str, np.ndarray]
) -> None:
    """An array that is not in a FIELD."""
    if key == "SCALARS":
        components = int(words[3]) if len(words) > 3 else 1
        table = cursor.need(f"LOOKUP_TABLE of {words[1]}").split()
        if table[0].upper() != "LOOKUP_TABLE":
            raise CaseError(f"{cursor.where()}: {table[0][:40]!r} where LOOKUP_TABLE should be")
    elif key in COMPONENTS:
        components = COMPONENTS[key]
    elif key in IDS:
        components = 1
    elif key == "LOOKUP_TABLE":
        cursor.values(4 * int(words[2]), "float" if cursor.text else "unsigned_char", key)
        return
    else:
        raise CaseError(f"{cursor.where()}: {key[:40]!r} is not known (of VTK's legacy format)")
    values = cursor.values(components * count, words[2], words[1])
    target[words[1]] = values if components == 1 else values.reshape(count, components)
