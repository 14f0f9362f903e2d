"""Options of the commands that import grains of other programs."""

import argparse
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compare.importing import axes, registry, units
from compare.importing.walls import Chosen


def arguments(parser):
    """All but the files themselves and what is written. Numbers are SI, whatever the units."""
    # -x is an axis and -1e-3 a number, no options
    parser._negative_number_matcher = re.compile(r"^-(\d|\.\d|[xyz]$)")
    group = parser.add_argument_group("grains of other programs (numbers in SI units)")
    add = group.add_argument
    add("--format", metavar="NAME", help="format of the files, where it is not told by them")
    add(
        "--contacts-from",
        nargs="+",
        type=Path,
        default=[],
        metavar="FILE",
        help="files of contacts",
    )
    add("--contacts", metavar="COLUMNS", help='their columns: "first=7,second=8,fx=10,fy=11,fz=12"')
    add("--columns", metavar="NAMES", help='of tables: "x=Position,radius=Size [mm]"')
    add("--case", type=Path, help="case file of the scene that the grains are of")
    add("--time-step", type=positive, metavar="S", help="of the run, where frames tell no time [s]")
    add("--density", type=positive, metavar="RHO", help="where the files tell no masses [kg/m3]")
    add(
        "--diameter",
        type=positive,
        metavar="D",
        help="of all grains, where files tell no radii [m]",
    )
    add(
        "--units", choices=[*units.SYSTEMS, "lj"], help="of the files (default: as they say, or si)"
    )
    for name in ("length", "mass", "time"):
        add(f"--lj-{name}", type=positive, metavar="X", help=f"unit of {name} of units lj")
    add("--up", choices=axes.WORDS, help="axis of the files that is up")
    add("--flow", choices=axes.WORDS, help="axis of the files along the flow")
    vector = {"nargs": 3, "type": number, "metavar": ("X", "Y", "Z")}
    add("--origin", **vector, help="our origin, in the files' axes [m]")
    add("--gravity", **vector, help="in the files' axes [m/s2] (default: 9.81 or the case's, down)")
    add("--wall-type", nargs="+", type=int, default=[], metavar="T", help="types of wall grains")
    add("--wall-id", nargs="+", type=ids, default=[], metavar="A:B", help="ids of wall grains")
    add(
        "--wall",
        choices=["frozen", "none"],
        default="frozen",
        help="without these: wall is what never moves (frozen), or nothing",
    )
    add("--skip-incomplete", action="store_true", help="leave frames out that were cut short")


def number(word: str) -> float:
    value = float(word)
    if not np.isfinite(value):
        raise argparse.ArgumentTypeError(f"{word} is no finite number")
    return value


def positive(word: str) -> float:
    value = number(word)
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f"{word} is not positive")
    return value


def ids(word: str) -> tuple[int, int]:
    """A range A:B of ids, both ends in it, or one id."""
    low, _, high = word.partition(":")
    found = int(low), int(high or low)
    if found[0] > found[1]:
        raise argparse.ArgumentTypeError(f"{word} holds no id")
    return found


@dataclass(frozen=True)
class Options:
    """What a command line says, and the files."""

    files: tuple[Path, ...]
    contact_files: tuple[Path, ...] = ()
    format: str | None = None
    contacts: str | None = None
    time_step: float | None = None
    density: float | None = None
    diameter: float | None = None
    units: str | None = None
    scales: tuple[float | None, float | None, float | None] = (None, None, None)
    up: str | None = None
    flow: str | None = None
    origin: tuple[float, ...] | None = None
    gravity: tuple[float, ...] | None = None
    walls: Chosen = Chosen()
    skip_incomplete: bool = False
    columns: str | None = None

    @classmethod
    def of(cls, files, words: argparse.Namespace) -> "Options":
        """Of a parsed command line. Raises CaseError for a format that is not known."""
        if words.format:
            registry.named(words.format)
        return cls(
            tuple(files),
            tuple(words.contacts_from),
            words.format,
            words.contacts,
            words.time_step,
            words.density,
            words.diameter,
            words.units,
            (words.lj_length, words.lj_mass, words.lj_time),
            words.up,
            words.flow,
            tuple(words.origin) if words.origin else None,
            tuple(words.gravity) if words.gravity else None,
            Chosen(tuple(words.wall_type), tuple(words.wall_id), words.wall == "frozen"),
            words.skip_incomplete,
            words.columns,
        )

    def reading(self, notes: list[str]) -> dict:
        """What readers are told."""
        out: dict = {"notes": notes}
        if self.skip_incomplete:
            out["incomplete"] = "drop"
        if self.columns:
            out["columns"] = self.columns
        if self.contacts:
            out["contacts"] = self.contacts
        return out
