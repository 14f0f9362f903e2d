"""The readers of compare/importing/readers, one file each."""

import importlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from cases.errors import CaseError
from compare.importing import compressed
from compare.importing.frame import Frame
from compare.importing.lines import Incomplete

HEAD = 4096  # bytes that a reader knows its files by


@dataclass(frozen=True)
class Reader:
    """A format. `recognises(path, head)` is asked with the first HEAD bytes, decompressed;
    `frames(path, options)` yields what the file holds in its order and raises CaseError at the line
    that it cannot read. `holds`: "grains", "contacts" or "points" (of a continuum).
    """

    name: str
    doc: str
    holds: str
    recognises: Callable[[Path, bytes], bool]
    frames: Callable[[Path, dict], Iterator[Frame]]


READERS: dict[str, Reader] = {}


def register(reader: Reader) -> Reader:
    READERS[reader.name] = reader
    return reader


def readers() -> dict[str, Reader]:
    """All readers by name."""
    for file in sorted((Path(__file__).parent / "readers").glob("[a-z]*.py")):
        importlib.import_module(f"compare.importing.readers.{file.stem}")
    return READERS


def reader_of(path: Path, holds: tuple[str, ...]) -> Reader:
    """The reader that knows a file, among those of what it may hold; raises CaseError if none or
    several do.
    """
    head = compressed.head(path, HEAD)
    if not head.strip():
        raise Incomplete(f"{path}: holds nothing (killed before it was written?)")
    known = [one for one in readers().values() if one.holds in holds]
    found = [one for one in known if one.recognises(path, head)]
    if len(found) == 1:
        return found[0]
    names = ", ".join(one.name for one in found or known)
    problem = "could be several" if found else "of no format that is known"
    raise CaseError(f"{path}: {problem} ({names}) name it: --format NAME")


def named(name: str) -> Reader:
    """The reader of a name; raises CaseError if there is none."""
    if name not in readers():
        raise CaseError(f"--format: '{name}' is not known (those that are: {', '.join(READERS)})")
    return READERS[name]
