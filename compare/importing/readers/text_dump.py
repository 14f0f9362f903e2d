"""Grains of text dumps of LIGGGHTS and LAMMPS, style `custom`."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from cases.errors import CaseError
from compare.importing.compressed import opened
from compare.importing.frame import Box, Frame
from compare.importing.registry import Reader, register


def recognises(path: Path, head: bytes) -> bool:
    return head.startswith(b"ITEM:") and b"ATOMS" in head


def frames(path: Path, options: dict) -> Iterator[Frame]:
    """The frames; raises CaseError at the line that is missing or wrong."""
    with opened(path) as file:
        lines = Lines(path, file)
        units = None
        while line := file.readline().decode(errors="replace"):
            lines.number += 1
            told: dict[str, Any] = {"source": str(path)}
            try:
                while not line.startswith("ITEM: ATOMS"):
                    line = section(lines, line, told)
                units = told.setdefault("units", units)
                told["columns"] = rows(lines, line.split()[2:], told.pop("count"))
            except Cut as cut:
                if options.get("incomplete") != "drop":
                    raise
                options["notes"].append(f"{cut}: this frame is left out")
                return
            yield Frame(**told)


class Cut(CaseError):
    """The file ends within a frame."""


class Lines:
    def __init__(self, path: Path, file):
        self.path, self.file, self.number = path, file, 0

    def next(self, what: str) -> str:
        line = self.file.readline().decode(errors="replace")
        if not line:
            raise Cut(
                f"{self.path}:{self.number}: ends here, {what} is missing (cut short?) "
                "--skip-incomplete leaves it out"
            )
        self.number += 1
        return line


def section(lines: Lines, line: str, told: dict) -> str:
    """Reads one section; returns the line that starts the next one."""
    name, where = line.removeprefix("ITEM:").strip(), f"{lines.path}:{lines.number}"
    if not line.startswith("ITEM:"):
        raise CaseError(f"{where}: expected 'ITEM: …' (not a text dump of LIGGGHTS or LAMMPS)")
    if name.startswith("BOX BOUNDS"):
        rows = [[float(word) for word in lines.next(name).split()] for _ in "xyz"]
        corners, sides = np.array(rows)[:, :2], name.split()[-3:]
        periodic = np.array([side == "pp" for side in sides])
        fixed = np.array([[face == "f" for face in side[:2]] for side in sides])
        told["box"] = Box(corners[:, 0], corners[:, 1], periodic, fixed)
    else:
        key, kind = {
            "TIMESTEP": ("step", int),
            "TIME": ("time", float),
            "UNITS": ("units", str),
            "NUMBER OF ATOMS": ("count", int),
        }[name]
        told[key] = kind(lines.next(name).strip())
    return lines.next("ITEM: ATOMS")


def rows(lines: Lines, names: list[str], count: int) -> dict[str, np.ndarray]:
    words = [lines.next(f"row {k + 1} of {count}").split() for k in range(count)]
    columns: dict[str, np.ndarray] = {}
    for k, name in enumerate(names):
        try:
            columns[name] = np.array([row[k] for row in words], float)
        except (ValueError, IndexError):
            if name != "element":
                raise Cut(f"{lines.path}:{lines.number}: column {name} has no number") from None
    if "diameter" in columns:
        columns["radius"] = columns.pop("diameter") / 2.0
    return columns


register(Reader("text_dump", "LAMMPS or LIGGGHTS text dump", "grains", recognises, frames))
