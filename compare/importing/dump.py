"""Text dumps of LAMMPS and LIGGGHTS: instants of sections that start with ITEM, in any order, the
rows of a table last. Grains (`dump custom`, `dump atom`) and contacts (`dump local`) share it.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cases.errors import CaseError
from compare.importing import table
from compare.importing.frame import Box, note
from compare.importing.lines import Incomplete, Lines, drop, opened

TEXT = ("element", "typelabel")  # columns of words
COMMENTS = re.compile(rb"\A(\s+|#[^\n]*(\n|\Z))+")  # and blanks, before what counts
MARK = b"ITEM: "  # starts a section
UNTOLD = "the box does not tell its boundaries: none is taken as periodic"
GRAINS = "ATOMS"  # what a table of grains is called


@dataclass
class Instant:
    """One instant as it stands in the file: `line` where it starts, `label` what the rows are,
    `header` the line that names the columns, `names` all of them and `columns` those of numbers.
    """

    line: int
    step: int | None = None
    time: float | None = None
    units: str | None = None
    box: Box | None = None
    count: int | None = None
    counted: str = ""
    flags: bool = True  # whether the box told its boundaries
    label: str = ""
    header: int = 0
    names: list[str] = field(default_factory=list)
    columns: dict[str, np.ndarray] = field(default_factory=dict)


def label_of(head: bytes) -> str | None:
    """What the first table of a file holds, by its first bytes: "ATOMS", "ENTRIES", …; "" where
    they do not tell, None where it is no text dump.
    """
    text = COMMENTS.sub(b"", head.removeprefix(b"\xef\xbb\xbf"))
    if not text or not (text.startswith(MARK) or MARK.startswith(text)) or b"\0" in head:
        return None
    _, found, rest = text.partition(MARK + b"NUMBER OF ")
    line, ended, _ = rest.partition(b"\n")
    return line.decode("utf-8", "replace").strip() if found and ended else ""


def instants(path: Path, options: dict) -> Iterator[Instant]:
    """The instants of a file one by one. Raises CaseError with the line of what is missing or
    wrong; where options["incomplete"] is "drop", what was cut short is left out, with a note.
    """
    with opened(path, MARK) as lines:
        units, found, dropped = None, False, False
        while skip_blank(lines):
            try:
                instant = read(lines, units, options)
            except Incomplete as error:
                drop(error, options)
                lines.skip_to_mark()
                dropped = True
                continue
            units, found = instant.units, True
            if not instant.flags:
                note(options, UNTOLD)
            yield instant
        try:
            lines.refuse_cut()
        except Incomplete as error:
            if not dropped:
                drop(error, options)
        if not found and options.get("incomplete") != "drop":
            raise CaseError(f"{path}: holds no instant (an empty file?)")


def skip_blank(lines: Lines) -> bool:
    """On to the next line that is neither blank nor a comment; whether there is one."""
    while (text := lines.line()) is not None:
        if text.strip("\ufeff \t") and not text.startswith("#"):
            lines.back()
            return True
    return False


def read(lines: Lines, units: str | None, options: dict) -> Instant:
    """The instant that starts at the next line; `units` are those told before."""
    here = Instant(lines.number + 1, units=units)
    seen: set[str] = set()
    missing = "ITEM: TIMESTEP"
    while True:
        line = text(lines, missing)
        if not line.lstrip("\ufeff").startswith(MARK.decode()):
            raise CaseError(
                f"{lines.where()}: {shown(line)} where a line 'ITEM: …' should be (no text dump of "
                "LIGGGHTS or LAMMPS, or more rows than are said to be)"
            )
        name = line.lstrip("\ufeff").removeprefix(MARK.decode()).strip()
        if not name.startswith("NUMBER OF") and here.counted and starts(name, here.counted):
            here.header, here.label = lines.number, here.counted
            here.names = name.removeprefix(here.counted).split()
            break
        kind = next((one for one in SECTIONS if starts(name, one)), "")
        if kind in seen:
            where = lines.where()
            lines.back()
            raise Incomplete(
                f"{where}: the instant of line {here.line} ends without its rows, another "
                f"begins with '{line.strip()}' (cut short?)"
            )
        if not kind and name.split()[:1] in ([GRAINS], ["ENTRIES"]):
            raise CaseError(
                f"{lines.where()}: no 'ITEM: NUMBER OF {name.split()[0]}' before the rows"
            )
        if not kind:
            note(options, f"{lines.where()}: '{line.strip()}' is not known, and is passed over")
            lines.skip_to_mark()
            continue
        seen.add(kind)
        SECTIONS[kind](here, lines, name)
        wanted = [one for one in ("TIMESTEP", "NUMBER OF") if one not in seen]
        missing = f"ITEM: {(wanted or [here.counted])[0]}"
    if "TIMESTEP" not in seen:
        raise CaseError(f"{lines.where()}: no 'ITEM: TIMESTEP' before the rows")
    if not here.names:
        raise CaseError(f"{lines.where()}: the columns have no names")
    rows(here, lines)
    return here


def starts(name: str, section: str) -> bool:
    """Whether a line's name is that of a section, alone or before other words."""
    return name == section or name.startswith(section + " ")


def shown(line: str) -> str:
    """A line for a message, not too long."""
    return repr(line.strip()[:40])


def text(lines: Lines, what: str) -> str:
    """The next line; Incomplete, with `what` is missing, where there is none that is whole."""
    line = lines.line()
    if line is None or not lines.ended:
        raise Incomplete(f"{lines.where()}: the file ends here, {what} is missing (cut short?)")
    return line


def value(lines: Lines, what: str) -> str:
    """The line after a section's name, without blanks around it."""
    line = text(lines, f"the value of {what}")
    if MARK.decode() in line:
        lines.back()
        raise Incomplete(f"{lines.where()}: the value of {what} is missing (cut short?)")
    return line.strip()


def is_finite(word: str) -> bool:
    return table.is_number(word.encode()) and bool(np.isfinite(float(word)))


def read_step(here: Instant, lines: Lines, name: str) -> None:
    here.step = whole(lines, name)


def whole(lines: Lines, name: str) -> int:
    word = value(lines, name)
    if re.fullmatch(r"[+-]?[0-9]{1,18}", word):
        return int(word)
    if is_finite(word) and float(word) == np.trunc(float(word)) and abs(float(word)) < 2.0**53:
        return int(float(word))  # 1e+06
    raise CaseError(f"{lines.where()}: {shown(word)} is no whole number ({name})")


def read_count(here: Instant, lines: Lines, name: str) -> None:
    here.counted = name.removeprefix("NUMBER OF").strip()
    if not here.counted:
        raise CaseError(f"{lines.where()}: 'ITEM: NUMBER OF' of what? (ATOMS, ENTRIES, …)")
    here.count = whole(lines, name)
    if here.count < 0:
        raise CaseError(f"{lines.where()}: {here.count} rows ({name})")


def read_time(here: Instant, lines: Lines, name: str) -> None:
    word = value(lines, name)
    if not is_finite(word):
        raise CaseError(f"{lines.where()}: {shown(word)} is no time")
    here.time = float(word)


def read_units(here: Instant, lines: Lines, name: str) -> None:
    word = value(lines, name).lower()
    if not word or (here.units is not None and word != here.units):
        raise CaseError(f"{lines.where()}: units {shown(word)} (before: {here.units})")
    here.units = word


def read_box(here: Instant, lines: Lines, name: str) -> None:
    """Corners, boundaries and tilt of the box. Of a triclinic one the file gives the rectangular
    box around it, from which LAMMPS' manual (Howto triclinic) leads to the corners.
    """
    words = name.split()[2:]
    if words[:1] == ["abc"]:
        raise CaseError(
            f"{lines.where()}: a box of general edges is not read ('abc origin') dump without "
            "triclinic/general yes"
        )
    tilted = words[:3] == ["xy", "xz", "yz"]
    flags = words[3:] if tilted else words
    if flags and (
        len(flags) != 3 or any(set(flag) - set("pfsm") or len(flag) != 2 for flag in flags)
    ):
        raise CaseError(
            f"{lines.where()}: boundaries {' '.join(flags)} (of p, f, s, m: 'pp ff ff')"
        )
    wanted = 3 if tilted else 2
    bounds = np.empty((3, wanted))
    for row, axis in zip(bounds, "xyz"):
        numbers = value(lines, f"{axis} of {name}").split()
        if len(numbers) != wanted or not all(map(is_finite, numbers)):
            raise CaseError(
                f"{lines.where()}: {shown(' '.join(numbers))} where {wanted} numbers should be "
                f"({axis} of {name})"
            )
        row[:] = [float(one) for one in numbers]
    lower, upper, tilt = bounds[:, 0].copy(), bounds[:, 1].copy(), None
    if tilted:
        tilt = bounds[:, 2]
        xy, xz, yz = tilt
        lower -= (min(0.0, xy, xz, xy + xz), min(0.0, yz), 0.0)
        upper -= (max(0.0, xy, xz, xy + xz), max(0.0, yz), 0.0)
    sides = flags or ["mm"] * 3
    periodic = np.array([side == "pp" for side in sides])
    fixed = np.array([[face == "f" for face in side] for side in sides])
    here.box, here.flags = Box(lower, upper, periodic, fixed, tilt), bool(flags)


SECTIONS = {
    "TIMESTEP": read_step,
    "TIME": read_time,
    "UNITS": read_units,
    "NUMBER OF": read_count,
    "BOX BOUNDS": read_box,
}


def rows(here: Instant, lines: Lines) -> None:
    """Reads the table of an instant."""
    assert here.count is not None
    first = lines.number + 1
    block = lines.rows(here.count)
    there = block.count(b"\n") + (not block.endswith(b"\n") and bool(block))
    torn = block and not block.endswith(b"\n")
    if there < here.count or (torn and not is_whole(block, len(here.names), lines)):
        raise Incomplete(
            f"{lines.where()}: row {there} of {here.count} is the last of this instant "
            + (
                "without an end of line (cut short? if it is whole, end it)"
                if torn
                else "(cut short?)"
            )
        )
    here.columns = table.columns(block, here.names, here.count, (str(lines.path), first), TEXT)


def is_whole(block: bytes, words: int, lines: Lines) -> bool:
    """Whether a last row without an end of line lacks nothing: a blank ends its last word, or all
    rows have the same one there.
    """
    last = [row.split()[-1:] for row in block.split(b"\n")]
    row = table.ends(block)[1]
    same = len(last) > 1 and all(word == last[0] for word in last)
    return not lines.cut and len(row.split()) == words and (same or row[-1:].isspace())
