"""Grains in tables: a line of headings, then rows apart by commas, semicolons, tabs or blanks, as
EDEM, Rocky, PFC, ParaView and spreadsheets export them.
"""

from collections.abc import Iterator
from pathlib import Path

from compare.importing import headed
from compare.importing.frame import Frame
from compare.importing.registry import Reader, register


def recognises(path: Path, head: bytes) -> bool:
    return headed.recognises(path, head)


def frames(path: Path, options: dict) -> Iterator[Frame]:
    """One frame for each value of a time or step column; without either, one."""
    return headed.frames(path, options)


register(Reader("csv", "tables with headings (CSV, TSV, blanks)", "grains", recognises, frames))
