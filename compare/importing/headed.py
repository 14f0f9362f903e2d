"""Frames from tables: a line of headings, then rows apart by commas, semicolons, tabs or blanks."""

import codecs
import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas

from cases.errors import CaseError
from compare.importing import headings, rows
from compare.importing.frame import Frame, note
from compare.importing.headings import Heading
from compare.importing.rows import Lines

SEARCHED = 60  # lines that headings may stand below
ROWS = 200_000  # read at a time
OTHERS = (b"ITEM:", b"#format", b"# vtk", b"<?xml", b"<VTKFile")  # what other readers know
AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Layout:
    """How the file is written, and what its columns are; `si` where their units say so."""

    separator: str | None
    decimal: str
    headings: list[Heading]
    numeric: list[bool]
    si: bool

    def column(self, name: str) -> int | None:
        """Where a column of KNOWN stands."""
        at = [i for i, h in enumerate(self.headings) if h.known and h.name == name]
        return at[0] if at else None


def separator_of(line: str) -> str | None:
    """What is between the words of a line; None for blanks."""
    return next((one for one in "\t;," if one in line), None)


def texts_of(line: bytes) -> tuple[list[str], str | None]:
    """The words of a line that may hold headings, and what separates them."""
    text = line.decode("utf-8-sig", errors="replace").strip().lstrip("#%/").strip()
    separator = separator_of(text)
    if separator is None:
        return next(csv.reader([text], delimiter=" ", skipinitialspace=True), []), None
    return rows.words(text.encode(), separator), separator


def are_headings(texts: list[str], columns: str | None = None) -> bool:
    """Whether words name the axes of a position, or what the user says of the columns."""
    if columns:
        wanted = {name.strip() for name in headings.given(columns, "").values()}
        bare = {headings.parts(text)[0] for text in texts} | set(texts)
        if all(name in bare or headings.parts(name)[0] in bare for name in wanted):
            return True
    return {headings.meaning(headings.parts(text)[0]) for text in texts} >= set(AXES)


def recognises(path: Path, head: bytes) -> bool:
    """Whether the first bytes hold headings that name a position."""
    start = head.removeprefix(codecs.BOM_UTF8).lstrip()
    if b"\0" in head or any(start.startswith(one) for one in OTHERS):
        return False
    return any(are_headings(texts_of(line)[0]) for line in head.splitlines()[:SEARCHED])


def layout_of(lines: Lines, options: dict) -> Layout:
    """Reads up to the first row; raises CaseError where headings are missing or could mean two
    things.
    """
    columns = options.get("columns")
    path = lines.path
    for _ in range(SEARCHED):
        line = lines.next()
        texts, separator = texts_of(line)
        if are_headings(texts, columns):
            break
        if not line:
            break
    else:
        line = b""
    if not line:
        raise CaseError(
            f"{path}: no line of headings that name x, y and z name them: "
            '--columns "x=NAME,y=NAME,z=NAME"'
        )
    where = lines.where
    found = headings.headings(texts, where, columns)
    missing = [axis for axis in AXES if axis not in {h.name for h in found if h.known}]
    if missing:
        raise CaseError(
            f"{where}: no column {', '.join(missing)} (has {', '.join(texts)}) name it: "
            f"--columns {missing[0]}=NAME"
        )
    while lines.peek() and not lines.peek().strip():
        lines.next()
    first = lines.peek()
    values = rows.words(first, separator)
    decimal = "," if separator == ";" and any("," in value for value in values) else "."
    if first and len(values) != len(found):
        raise CaseError(
            f"{path}:{lines.number + 1}: {len(values)} values below {len(found)} headings"
        )
    numeric = [not text or is_number(text.replace(decimal, ".")) for text in values]
    for heading, one, value in zip(found, numeric, values):
        if heading.known and heading.name not in ("id", "type") and not one:
            rows.number(value, f"{path}:{lines.number + 1}: {heading.text}")
    return Layout(separator, decimal, found, numeric, headings.in_si(found, where))


def is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def frames(path: Path, options: dict) -> Iterator[Frame]:
    """One frame for each value of the column of time or step; without either, one of all rows."""
    with rows.lines_of(path) as lines:
        layout = layout_of(lines, options)
        key = layout.column("time")
        key = layout.column("step") if key is None else key
        kept: list[pandas.DataFrame] = []
        at, seen = lines.number + 1, set()
        for first, part in parts_of(lines, layout, options):
            edges = [0, len(part)]
            if key is not None:
                edges[1:1] = (np.flatnonzero(np.diff(part[key].to_numpy())) + 1).tolist()
            for a, b in zip(edges[:-1], edges[1:]):
                piece = part.iloc[a:b]
                if kept and key is not None and kept[-1][key].iloc[0] != piece[key].iloc[0]:
                    yield frame_of(kept, layout, f"{path}:{at}", options)
                    seen.add(kept[-1][key].iloc[0])
                    kept, at = [], first + a
                    if piece[key].iloc[0] in seen:
                        raise CaseError(
                            f"{path}:{at}: {layout.headings[key].text} {piece[key].iloc[0]:g} was "
                            "left and comes again sort the rows by it"
                        )
                kept.append(piece)
        if sum(map(len, kept)):
            yield frame_of(kept, layout, f"{path}:{at}", options)
        elif not seen:
            raise CaseError(f"{path}: no rows below the headings")


def parts_of(lines: Lines, layout: Layout, options: dict) -> Iterator[tuple[int, pandas.DataFrame]]:
    """The rows, a number at a time, with the line that the first of them stands in."""
    while lines.peek():
        first = lines.number + 1
        block = lines.take(ROWS)
        if not lines.peek():
            while block and not block[-1].strip():
                block.pop()
            if block and not block[-1].endswith(b"\n") and options.get("incomplete") == "drop":
                if len(rows.words(block[-1], layout.separator)) < len(layout.headings):
                    block = without_last(block, layout)
                    note(options, f"{lines.path}: an incomplete last frame was dropped")
        if block:
            yield first, rows.parsed(
                block, layout.numeric, lines.path, first, layout.separator, layout.decimal
            )


def without_last(block: list[bytes], layout: Layout) -> list[bytes]:
    """The rows before the frame that the last, broken one belongs to."""
    key = layout.column("time")
    key = layout.column("step") if key is None else key
    if key is None:
        return []
    last = rows.words(block[-2], layout.separator)[key] if len(block) > 1 else ""
    end = len(block) - 1
    while end and rows.words(block[end - 1], layout.separator)[key] == last:
        end -= 1
    return block[:end]


def frame_of(kept: list[pandas.DataFrame], layout: Layout, where: str, options: dict) -> Frame:
    """A frame of rows, in SI where units are told."""
    frame = Frame(where, units="si" if layout.si else None)
    whole = kept[0] if len(kept) == 1 else pandas.concat(kept)
    for i, (heading, one) in enumerate(zip(layout.headings, layout.numeric)):
        if not one or not heading.text:
            continue
        values = whole[i].to_numpy()
        frame.columns[heading.name] = values * heading.factor if heading.factor else values
    if "diameter" in frame.columns and "radius" not in frame.columns:
        frame.columns["radius"] = 0.5 * frame.columns.pop("diameter")
    if "time" in frame.columns:
        frame.time = float(frame.columns.pop("time")[0])
    if "step" in frame.columns:
        frame.step = int(frame.columns.pop("step")[0])
    numbered(frame, where, options)
    return frame


def numbered(frame: Frame, where: str, options: dict):
    """Whole ids; those of a file without any are the numbers of the rows."""
    if "id" not in frame.columns:
        path = where.rpartition(":")[0]
        note(options, f"{path}: no ids, so a grain is told by the number of its row")
        frame.columns["id"] = np.arange(1, len(frame.columns["x"]) + 1)
        return
    values = frame.columns["id"]
    if not np.all(np.isfinite(values) & (values == np.round(values)) & (np.abs(values) < 2**53)):
        raise CaseError(f"{where}: ids below are not whole numbers choose: --columns id=NAME")
    frame.columns["id"] = values.astype(np.int64)
