"""Spheres as YADE writes them: `export.text` and `export.textExt` (yade/py/export.py).

The first line names the format; with attributes the last line of the comment, after "# x y z r",
names their columns: one word for a number, three for a vector, nine for a matrix. Such a file is
one instant, and tells neither time nor, in most formats, ids.
"""

import re
from collections.abc import Iterator
from pathlib import Path

from cases.errors import CaseError
from compare.importing import headings, rows
from compare.importing.frame import Frame
from compare.importing.registry import Reader, register
from compare.importing.rows import Lines
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
    with rows.lines_of(path) as lines:
        names = names_of(lines, options)
        first = lines.number + 1
        block: list[bytes] = []
        while lines.peek():
            line = lines.next()
            if line.lstrip().startswith(b"#") or not line.strip():
                if block:
                    raise CaseError(f"{lines.where}: a comment or empty line among the spheres")
                first = lines.number + 1
            else:
                block.append(line)
        table = rows.numbers(block, len(names), path, first)
    frame = Frame(f"{path}:{first}", dict(zip(names, table.T)))
    number = re.findall(r"\d+", path.name.partition(".")[0])
    if number:
        frame.step = int(number[-1])
    numbered(frame, frame.source, options)
    yield frame


def names_of(lines: Lines, options: dict) -> list[str]:
    """The names of the columns, from the lines before the first row."""
    words = lines.next().split()
    given = words[1].decode(errors="replace") if len(words) == 2 else ""
    if given not in FORMATS:
        raise CaseError(
            f"{lines.where}: format '{given}' (known: {', '.join(FORMATS)}) export spheres with "
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
