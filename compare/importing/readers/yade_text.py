"""Spheres as YADE writes them: `export.text` and `export.textExt` (yade/py/export.py).

The first line names the format; with attributes the last line of the comment, after "# x y z r",
names their columns: one word for a number, three for a vector, nine for a matrix. Such a file is
one instant, and tells neither time nor, in most formats, ids.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cases.errors import CaseError
from compare.importing import headings, points, rows
from compare.importing import lines as text
from compare.importing.frame import Frame
from compare.importing.lines import Lines
from compare.importing.registry import Reader, register
from compare.importing.headed import numbered

FORMATS = {
    "x_y_z_r": ["x", "y", "z", "r"],
    "x_y_z_r_matId": ["x", "y", "z", "r", "type"],
    "id_x_y_z_r_matId": ["id", "x", "y", "z", "r", "type"],
    "x_y_z_r_clumpId": ["x", "y", "z", "r", "clump"],
    "x_y_z_r_attrs": ["x", "y", "z", "r"],
}
BEFORE = re.compile(rb"#\s*x\s+y\s+z\s+r\b(.*)")


def recognises(path: Path, head: bytes) -> bool:
    return head.startswith(b"#format ") and b"x_y_z_r" in head.split(b"\n", 1)[0]


def frames(path: Path, options: dict) -> Iterator[Frame]:
    """The one frame of a file; its step is the last number in the file's name."""
    with text.opened(path, b"#") as lines:
        names = names_of(lines, options)
        at, parts = lines.number + 1, [np.empty((0, len(names)))]
        while lines.peek():
            first, block = lines.number + 1, lines.rows()
            parts.append(rows.numbers(block, len(names), path, first))
            while lines.peek().startswith(b"#"):
                if lines.next().startswith(b"#format"):
                    raise CaseError(f"{lines.where()}: another export begins here (one a file)")
        lines.refuse_cut()
    columns = dict(zip(names, np.concatenate(parts).T))
    frame = Frame(f"{path}:{at}", columns, points.step_of(path))
    numbered(frame, frame.source, options)
    yield frame


def names_of(lines: Lines, options: dict) -> list[str]:
    """The names of the columns, from the lines before the first row."""
    words = lines.next().split()
    given = words[1].decode(errors="replace") if len(words) == 2 else ""
    if given not in FORMATS:
        raise CaseError(
            f"{lines.where()}: format '{given}' (known: {', '.join(FORMATS)}) export spheres with "
            "one of them"
        )
    names, extra = list(FORMATS[given]), None
    while lines.peek().startswith(b"#") or b"# x y z r" in lines.peek():
        found = BEFORE.search(lines.next())
        extra = found[1].decode(errors="replace").split() if found else extra
    if given.endswith("attrs"):
        values = len(lines.peek().split())
        if extra is None and values > len(names):
            raise CaseError(
                f"{lines.path}:1: attributes without their names give export.textExt a comment "
                "that names the columns, as 'vx vy vz'"
            )
        names += extra or []
    found_names = headings.headings(names, f"{lines.path}:1", options.get("columns"))
    return [heading.name for heading in found_names]


register(Reader("yade", "YADE export.text and export.textExt", "grains", recognises, frames))
