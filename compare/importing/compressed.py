"""Files that may be compressed: gzip, zstd, bzip2 or xz, told by their first bytes."""

import bz2
import gzip
import io
import lzma
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO, cast

import zstandard

from cases.errors import CaseError

ZSTD = b"\x28\xb5\x2f\xfd"
# What opens a stream, by how it begins; these hand over all that is whole before they break off.
STREAMS: dict[bytes, Callable[[BinaryIO], Any]] = {
    b"\x1f\x8b": lambda raw: gzip.GzipFile(fileobj=raw),
    b"BZh": bz2.BZ2File,
    b"\xfd7zX": lzma.LZMAFile,
}
BROKEN = (EOFError, gzip.BadGzipFile, zlib.error, lzma.LZMAError, zstandard.ZstdError)
BUFFER = 1 << 20  # bytes
READING: dict[Path, Callable[[], int]] = {}  # bytes taken so far of the files that are open
PIECE = 4096  # bytes of a zstd stream taken at a time: one may swell forty thousandfold


class ZstdStream(io.RawIOBase):
    """What a zstd file holds; raises EOFError where its last frame has no end, of which the
    library's own stream says nothing.
    """

    def __init__(self, raw: BinaryIO):
        self._raw, self._packed, self._plain = raw, b"", b""
        self._frame: Any = None  # what decompresses the frame that is open

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        while not self._plain:
            packed = self._packed or self._raw.read(PIECE)
            if not packed:
                if self._frame is not None:
                    raise EOFError("zstd stream ended before its end mark")
                return 0
            if self._frame is None:
                self._frame = zstandard.ZstdDecompressor().decompressobj()
            self._plain, self._packed = self._frame.decompress(packed), b""
            if self._frame.eof:
                self._packed, self._frame = self._frame.unused_data, None
        size = min(len(buffer), len(self._plain))
        buffer[:size], self._plain = self._plain[:size], self._plain[size:]
        return size


@contextmanager
def opened(path: Path) -> Iterator[BinaryIO]:
    """The file's bytes, decompressed as they are read. Raises CaseError where it cannot be read, or
    where its compressed stream is broken or cut short.
    """
    try:
        with open(path, "rb") as raw:
            READING[path] = raw.tell
            yield plain(raw)
    except BROKEN as error:
        raise CaseError(f"{path}: broken compressed stream ({error})") from error
    except OSError as error:
        raise CaseError(f"{path}: cannot be read ({error.strerror or error})") from error
    finally:
        READING.pop(path, None)


def plain(raw: io.BufferedReader) -> BinaryIO:
    """The stream that a raw one holds."""
    magic = raw.peek(4)[:4]
    if magic == ZSTD:
        return cast(BinaryIO, io.BufferedReader(ZstdStream(raw), BUFFER))
    for start, opening in STREAMS.items():
        if magic.startswith(start):
            return cast(BinaryIO, opening(raw))
    return raw


def head(path: Path, size: int) -> bytes:
    """The first bytes of a file, or all that there are, of one that is cut short too."""
    out = b""
    with opened(path) as file, suppress(EOFError):
        while len(out) < size and (piece := file.read1(size - len(out))):  # type: ignore
            out += piece
    return out
