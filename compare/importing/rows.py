"""Rows of values in text files: fast where they are right, by the line where they are not."""

import csv
import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pandas

from cases.errors import CaseError
from compare.importing.compressed import opened


class Lines:
    """The lines of a file one by one, the number of the last one that was read in `number`."""

    def __init__(self, file: BinaryIO, path: Path):
        self.file, self.path, self.number = file, path, 0
        self.kept: bytes | None = None

    def peek(self) -> bytes:
        """The next line, not yet read; empty at the end."""
        if self.kept is None:
            self.kept = self.file.readline()
        return self.kept

    def next(self) -> bytes:
        line = self.peek()
        self.kept = None
        self.number += bool(line)
        return line

    def take(self, count: int) -> list[bytes]:
        """The next `count` lines, or what there is of them."""
        first = [self.next()] if count and self.peek() else []
        block = first + list(islice(self.file, count - len(first)))
        self.number += len(block) - len(first)
        return block

    @property
    def where(self) -> str:
        return f"{self.path}:{self.number}"


@contextmanager
def lines_of(path: Path) -> Iterator[Lines]:
    """Lines of a file, decompressed; raises CaseError as compressed.opened does."""
    with opened(path) as file:
        yield Lines(file, path)


def numbers(lines: list[bytes], width: int, path: Path, first: int) -> np.ndarray:
    """The numbers (N, width) in `lines`, apart by blanks, the first of which is line `first` of the
    file; raises CaseError at the line that holds another count of them, or something else.
    """
    if not lines:
        return np.empty((0, width))
    return parsed(lines, [True] * width, path, first).to_numpy()


def parsed(
    lines: list[bytes],
    numeric: Sequence[bool],
    path: Path,
    first: int,
    separator: str | None = None,
    decimal: str = ".",
) -> pandas.DataFrame:
    """The table in `lines`, its columns counted from 0; what is not `numeric` stays text. Blanks
    separate where there is no `separator`. Raises CaseError as `numbers` does.
    """
    problem: Exception | None = None
    try:
        table = pandas.read_csv(
            io.BytesIO(b"".join(lines)),
            engine="c",
            header=None,
            sep=separator or r"\s+",
            decimal=decimal,
            dtype={i: float if one else str for i, one in enumerate(numeric)},
            float_precision="round_trip",
            skip_blank_lines=False,
            skipinitialspace=True,
            encoding_errors="replace",
            quoting=0 if separator else 3,
        )
        values = table.loc[:, [i for i, one in enumerate(numeric) if one and i in table.columns]]
        if table.shape[1] == len(numeric) and not np.isnan(values.to_numpy()).any():
            return table
    except (ValueError, OverflowError) as error:  # pandas' own errors are ValueErrors
        problem = error
    for number, line in enumerate(lines, start=first):
        check(line, numeric, f"{path}:{number}", separator, decimal)
    if problem is not None or table.shape[1] != len(numeric):
        why = " ".join(str(problem or f"{table.shape[1]} columns").split())
        raise CaseError(f"{path}:{first}: the rows cannot be read ({why})")
    return table


def words(line: bytes, separator: str | None) -> list[str]:
    """The values in a line."""
    text = line.decode(errors="replace").rstrip("\r\n")
    if separator is None:
        return text.split()
    found = next(csv.reader([text], delimiter=separator, skipinitialspace=True), [""])
    return [word.strip() for word in found]


def check(line: bytes, numeric: Sequence[bool], where: str, separator: str | None, decimal: str):
    """Raises CaseError unless the line holds as many values as `numeric`, numbers where it says."""
    values = words(line, separator)
    if len(values) != len(numeric):
        raise CaseError(f"{where}: {len(values)} values instead of {len(numeric)} (cut short?)")
    for value, one in zip(values, numeric):
        if one:
            number(value.replace(decimal, "."), where)


def number(word: str | bytes, where: str) -> float:
    """The number that a word is, nan among them; raises CaseError if it is none."""
    try:
        return float(word)
    except ValueError:
        text = word.decode(errors="replace") if isinstance(word, bytes) else word
        raise CaseError(f"{where}: '{text[:40]}' is no number") from None


def count(word: str | bytes, where: str) -> int:
    """The count that a word is; raises CaseError if it is none."""
    value = number(word, where)
    if not 0 <= value < 1e12 or value != int(value):
        raise CaseError(f"{where}: {value:g} is no count")
    return int(value)
