"""Frames from tables: a line of headings, then rows apart by commas, semicolons, tabs or blanks."""

import codecs
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas

from cases.errors import CaseError
from compare.importing import headings, rows
from compare.importing import lines as text
from compare.importing.frame import Frame, note
from compare.importing.headings import Heading
from compare.importing.lines import Incomplete, Lines, drop
from compare.importing.registry import HEAD

SEARCHED = 60  # lines that headings may stand below
ROWS = 200_000  # read at a time
OTHERS = (b"ITEM:", b"#format", b"# vtk", b"<?xml", b"<VTKFile")  # what other readers know
AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Layout:
    """How the file is written, and what its columns are; `si` where their units say so. `header` is
    the line of headings, which may come again.
    """

    header: bytes
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
    return next((one for one in "\t;,|" if one in line), None)


def texts_of(line: bytes) -> tuple[list[str], str | None]:
    """The words of a line that may hold headings, and what separates them."""
    try:
        text = line.decode("utf-8-sig")
    except UnicodeDecodeError:  # an older spreadsheet's µ
        text = line.decode("latin-1")
    text = text.strip().lstrip("#%/").strip()
    separator = separator_of(text)
    if separator is None:
        return rows.fields(text, " "), None
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
    lines = head.splitlines()
    if len(head) >= HEAD:  # the last one may be cut
        lines.pop()
    if any(line.startswith(OTHERS[0]) for line in lines):  # below a comment
        return False
    return any(
        are_headings(texts_of(line)[0]) and are_apart_alike(line, lines[number:])
        for number, line in enumerate(lines[:SEARCHED], start=1)
    )


def are_apart_alike(line: bytes, below: list[bytes]) -> bool:
    """Whether what stands below headings that begin with an unknown word has as many values: a line
    of a script may name x y z too.
    """
    texts, separator = texts_of(line)
    if headings.meaning(headings.parts(texts[0])[0]):
        return True
    rows_below = [one for one in below if one.strip() and not one.startswith(b"#")]
    return not rows_below or len(rows.words(rows_below[0], separator)) == len(texts)


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
    where = lines.where()
    if joined := with_units(texts, lines.peek(), separator):
        texts = joined
        lines.next()
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
    # A value that lacks below a heading is one of a column of numbers.
    numeric = [
        is_number(value.replace(decimal, ".")) or bool(heading.text and not value)
        for heading, value in zip(found, values)
    ]
    for heading, one, value in zip(found, numeric, values):
        if heading.known and heading.name not in ("id", "type") and not one:
            rows.number(value, f"{path}:{lines.number + 1}: {heading.text}")
    return Layout(line, separator, decimal, found, numeric, headings.in_si(found, where))


def with_units(texts: list[str], below: bytes, separator: str | None) -> list[str] | None:
    """The headings with the units that a line below them has; None where it has none."""
    units = rows.words(below, separator)
    if len(units) != len(texts) or any(is_number(unit) for unit in units):
        return None
    joined = [f"{text} [{unit.strip('[]()')}]" for text, unit in zip(texts, units)]
    try:
        found = headings.headings(joined, "")
    except CaseError:
        return None
    return joined if any(heading.factor for heading in found) else None


def is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def frames(path: Path, options: dict) -> Iterator[Frame]:
    """One frame for each value of the column of time or step; without either, one of all rows."""
    with text.opened(path) as lines:
        layout = layout_of(lines, options)
        key = layout.column("time")
        key = layout.column("step") if key is None else key
        kept: list[pandas.DataFrame] = []
        at, seen = lines.number + 1, set()
        try:
            for first, part in parts_of(lines, layout):
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
                                f"{path}:{at}: {layout.headings[key].text} {piece[key].iloc[0]:g} "
                                "was left and comes again sort the rows by it"
                            )
                    kept.append(piece)
        except Incomplete as error:
            drop(error, options)
            kept = []  # the frame that the broken row belongs to
        if sum(map(len, kept)):
            yield frame_of(kept, layout, f"{path}:{at}", options)
        elif not seen:
            raise CaseError(f"{path}: no rows below the headings")


def parts_of(lines: Lines, layout: Layout) -> Iterator[tuple[int, pandas.DataFrame]]:
    """The rows, a number at a time, with the line that the first of them stands in; at last raises
    Incomplete where the last one lacks values.
    """
    while lines.peek():
        first, torn = lines.number + 1, None
        block = lines.rows(ROWS)
        if not lines.ended:
            end = block.rfind(b"\n") + 1
            found = len(rows.words(block[end:], layout.separator))
            if block[end:].strip() and found < len(layout.headings):
                block, torn = block[:end], f"{found} values instead of {len(layout.headings)}"
        if b"#" in block or layout.header.strip() in block:  # lines that are no rows are made blank
            again = re.escape(layout.header.strip())
            block = re.sub(rb"(?m)^(#.*|%s\s*?)$" % again, b"", block)
        if not block.isspace():
            yield first, rows.parsed(
                block, layout.numeric, lines.path, first, layout.separator, layout.decimal
            )
        if torn:
            raise Incomplete(f"{lines.where()}: {torn} (cut short?)")
    lines.refuse_cut()


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
        note(options, "assumed: a grain is told by the number of its row (there are no ids)")
        frame.columns["id"] = np.arange(1, len(frame.columns["x"]) + 1)
        return
    values = frame.columns["id"]
    if not np.all(np.isfinite(values) & (values == np.round(values)) & (np.abs(values) < 2**53)):
        raise CaseError(f"{where}: ids below are not whole numbers choose: --columns id=NAME")
    frame.columns["id"] = values.astype(np.int64)
