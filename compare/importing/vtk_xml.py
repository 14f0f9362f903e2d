"""VTK's XML format: points and their arrays of polydata (.vtp) and unstructured grids (.vtu), the
corners of rectilinear grids, and lists of files (.pvtp, .pvtu, .pvd).

meshio reads no polydata, and of grids no version after 1.0. [VTK file formats, docs.vtk.org]
"""

import base64
import binascii
import lzma
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal
from xml.etree import ElementTree

import numpy as np

from cases.errors import CaseError
from compare.importing import compressed
from compare.importing.lines import Incomplete
from compare.importing.vtk_legacy import Cloud

MARK = b"<VTKFile"
GRIDS = ("PolyData", "UnstructuredGrid")
TYPES = {
    f"{kind}{8 * size}": f"{code}{size}"
    for kind, code in (("Int", "i"), ("UInt", "u"), ("Float", "f"))
    for size in (1, 2, 4, 8)
    if (kind, size) != ("Float", 1)
}
UNPACK: dict[str, Callable[[bytes], bytes]] = {
    "vtkZLibDataCompressor": zlib.decompress,
    "vtkLZMADataCompressor": lzma.decompress,
}
Order = Literal["<", ">"]
BROKEN = (
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    OverflowError,
    binascii.Error,
    zlib.error,
    lzma.LZMAError,
)


@dataclass
class Document:
    """The tree, and what is appended to it, base64 or raw."""

    path: Path
    root: ElementTree.Element
    appended: bytes = b""
    raw: bool = False

    def array(self, element: ElementTree.Element) -> np.ndarray:
        """The numbers of a DataArray, (tuples,) or (tuples, components)."""
        name = element.get("Name", "array")
        try:
            values = self.numbers(element)
            components = int(element.get("NumberOfComponents") or 1)
            return values if components == 1 else values.reshape(-1, components)
        except BROKEN as error:
            raise CaseError(f"{self.path}: {name} cannot be read ({error})") from error

    def numbers(self, element: ElementTree.Element) -> np.ndarray:
        order: Order = "<" if self.root.get("byte_order") != "BigEndian" else ">"
        dtype = np.dtype(TYPES[element.get("type", "")])
        form = element.get("format", "ascii")
        if form == "ascii":
            words = (element.text or "").split()
            return np.array(words, np.float64 if dtype.kind == "f" else np.int64)
        if form == "binary":
            data = self.block((element.text or "").strip().encode(), True, order)
        elif form == "appended":
            data = self.block(self.appended[int(element.get("offset", "")) :], not self.raw, order)
        else:
            raise ValueError(f"format {form}")
        return np.frombuffer(data, dtype.newbyteorder(order)).astype(dtype)

    def block(self, data: bytes, encoded: bool, order: Order) -> bytes:
        """What a header tells to be in `data`: one run of bytes, or compressed pieces."""
        kind = np.dtype(TYPES[self.root.get("header_type", "UInt32")]).newbyteorder(order)
        taken = Base64(data) if encoded else Raw(data)
        (first,) = np.frombuffer(taken(kind.itemsize), kind)
        compressor = self.root.get("compressor")
        if not compressor:
            return taken(int(first))
        if compressor not in UNPACK:
            raise ValueError(f"{compressor} is not read")
        # Compressed: the header has the number of pieces, two sizes and the sizes packed, and is
        # encoded by itself.
        taken = Base64(data) if encoded else Raw(data)
        header = np.frombuffer(taken((3 + int(first)) * kind.itemsize), kind)
        taken.close()
        return b"".join(UNPACK[compressor](taken(int(size))) for size in header[3:])


class Raw:
    """Hands out bytes one run after the other."""

    def __init__(self, data: bytes):
        self.data, self.at = data, 0

    def __call__(self, size: int) -> bytes:
        out = self.data[self.at : self.at + size]
        if len(out) != size:
            raise ValueError(f"{size} bytes should follow, {len(out)} do")
        self.at += size
        return out

    def close(self) -> None:
        """Ends what is encoded as one."""


class Base64(Raw):
    """The same of bytes that are encoded, in parts that may each end in padding."""

    def __init__(self, data: bytes):
        super().__init__(data)
        self.plain = b""

    def __call__(self, size: int) -> bytes:
        while len(self.plain) < size:
            wanted = -(-(size - len(self.plain)) // 3) * 4
            part = self.data[self.at : self.at + wanted]
            if (pad := part.find(b"=")) >= 0:
                part = part[: -(-(pad + 1) // 4) * 4]
            if not part:
                raise ValueError(f"{size} bytes should follow, {len(self.plain)} do")
            self.at += len(part)
            self.plain += base64.b64decode(part, validate=True)
        out, self.plain = self.plain[:size], self.plain[size:]
        return out

    def close(self) -> None:
        self.plain = b""


def parse(path: Path, data: bytes) -> Document:
    """The document of a file; Incomplete where its elements have no end."""
    start = data.find(b"<AppendedData")
    appended, raw = b"", False
    if start >= 0:
        inside = data.find(b">", start) + 1
        stop = data.rfind(b"</AppendedData>")
        if not inside or stop < 0:
            raise Incomplete(f"{path}: the appended data has no end (cut short?)")
        raw = b'"raw"' in data[start:inside].replace(b"'", b'"')
        appended = data[data.find(b"_", inside) + 1 : stop]
        data = data[:start] + b"</VTKFile>"
    try:
        return Document(path, ElementTree.fromstring(data), appended, raw)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise Incomplete(f"{path}: no whole XML ({error}) (cut short?)") from None


def read(path: Path, data: bytes) -> Cloud:
    """Points and arrays of a file; raises CaseError where it is not as it should be."""
    document = parse(path, data)
    kind = document.root.get("type", "")
    if kind.startswith("P") and kind[1:] in GRIDS:
        return gathered(path, kind, document)
    cloud = Cloud(kind)
    grid = next((one for one in document.root if one.tag == kind), None)
    if grid is None:
        raise CaseError(f"{path}: no {kind or 'grid'} in the VTKFile")
    for element in grid.findall("FieldData/DataArray"):
        cloud.whole[element.get("Name", "")] = document.array(element)
    pieces = grid.findall("Piece")
    if kind == "RectilinearGrid":
        axes = [document.array(one) for one in grid.findall("Piece/Coordinates/DataArray")]
        if len(axes) == 3 and all(axis.size for axis in axes):
            cloud.corners = np.array([(axis.min(), axis.max()) for axis in axes]).T
    elif kind in GRIDS:
        clouds = [of_piece(document, kind, piece) for piece in pieces]
        joined(path, cloud, clouds)
    return cloud


def of_piece(document: Document, kind: str, piece: ElementTree.Element) -> Cloud:
    element = piece.find("Points/DataArray")
    points = np.empty((0, 3)) if element is None else document.array(element)
    if points.size == 0:
        points = points.reshape(0, 3)
    arrays = {
        one.get("Name", ""): document.array(one)
        for one in piece.findall("PointData/DataArray")
        if one.get("type") in TYPES
    }
    if piece.get("NumberOfPoints", "") != str(len(points)) or points.shape[1:] != (3,):
        raise CaseError(
            f"{document.path}: {len(points)} points where {piece.get('NumberOfPoints')} should be"
        )
    return Cloud(kind, points, arrays)


def joined(path: Path, cloud: Cloud, clouds: list[Cloud]) -> None:
    """Puts clouds behind each other into `cloud`."""
    clouds = [one for one in clouds if len(one.points)] or clouds[:1]
    if not clouds:
        return
    cloud.points = np.concatenate([one.points for one in clouds])
    for name in clouds[0].arrays:
        parts: list[Any] = [one.arrays.get(name) for one in clouds]
        if any(part is None or part.shape[1:] != parts[0].shape[1:] for part in parts):
            raise CaseError(f"{path}: not every piece has the same array {name}")
        cloud.arrays[name] = np.concatenate(parts)


def gathered(path: Path, kind: str, document: Document) -> Cloud:
    """The pieces that a parallel file lists."""
    clouds = []
    for piece in document.root.findall(f"{kind}/Piece"):
        source = path.parent / piece.get("Source", "")
        if source == path or source.suffix.startswith(".p"):
            raise CaseError(f"{path}: lists {source.name} as its piece")
        with compressed.opened(source) as file:
            clouds.append(read(source, file.read()))
    cloud = Cloud(kind[1:])
    joined(path, cloud, clouds)
    return cloud


def collection(path: Path, data: bytes) -> list[tuple[float | None, Path]] | None:
    """Times and files of a .pvd, in its order; None where the file is none."""
    root = parse(path, data).root
    if root.get("type") != "Collection":
        return None
    out: list[tuple[float | None, Path]] = []
    for entry in root.findall("Collection/DataSet"):
        time, name = entry.get("timestep"), entry.get("file")
        try:
            out.append((None if time is None else float(time), path.parent / (name or "")))
        except ValueError:
            raise CaseError(f"{path}: timestep {time!r} is no number") from None
        if not name:
            raise CaseError(f"{path}: a DataSet without a file")
    return out
