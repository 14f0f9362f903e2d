"""Grains in tables: a line of headings, then rows apart by commas, semicolons, tabs or blanks, as
EDEM, Rocky, PFC, ParaView and spreadsheets export them.
"""

from collections.abc import Iterator
from pathlib import Path

from compare.importing import headed, points
from compare.importing.frame import Frame
from compare.importing.registry import Reader, register


def recognises(path: Path, head: bytes) -> bool:
    return headed.recognises(path, head)


def frames(path: Path, options: dict) -> Iterator[Frame]:
    """One frame for each value of a time or step column; without either, one, whose step is the
    last number in the file's name.
    """
    for frame in headed.frames(path, options):
        if frame.step is None and frame.time is None:
            frame.step = points.step_of(path)
        yield frame


register(Reader("csv", "tables with headings (CSV, TSV, blanks)", "grains", recognises, frames))
