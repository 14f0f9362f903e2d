"""Files that may be compressed: gzip or zstd, told by their first bytes."""

import gzip
import io
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, cast

import zstandard

from cases.errors import CaseError

GZIP, ZSTD = b"\x1f\x8b", b"\x28\xb5\x2f\xfd"
BUFFER = 1 << 20  # bytes
READING: dict[Path, Callable[[], int]] = {}  # bytes taken so far of the files that are open


@contextmanager
def opened(path: Path) -> Iterator[BinaryIO]:
    """The file's bytes, decompressed as they are read. Raises CaseError where it cannot be read, or
    where its compressed stream is broken or cut short.
    """
    try:
        with open(path, "rb") as raw:
            READING[path] = raw.tell
            yield plain(raw)
    except (EOFError, gzip.BadGzipFile, zlib.error, zstandard.ZstdError) as error:
        raise CaseError(f"{path}: broken compressed stream ({error})") from error
    except OSError as error:
        raise CaseError(f"{path}: cannot be read ({error.strerror or error})") from error
    finally:
        READING.pop(path, None)


def plain(raw: io.BufferedReader) -> BinaryIO:
    """The stream that a raw one holds."""
    magic = raw.peek(4)[:4]
    if magic[:2] == GZIP:
        packed: Any = gzip.GzipFile(fileobj=raw)
    elif magic == ZSTD:
        packed = zstandard.ZstdDecompressor().stream_reader(raw, read_across_frames=True)
    else:
        return raw
    return cast(BinaryIO, io.BufferedReader(packed, BUFFER))


def head(path: Path, size: int) -> bytes:
    """The first bytes of a file."""
    with opened(path) as file:
        return file.read(size)
