"""Rows of values in text files: fast where they are right, by the line where they are not."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

import numpy as np
import pandas

from cases.errors import CaseError


def numbers(block: bytes, width: int, path: Path, first: int) -> np.ndarray:
    """The numbers (N, width) in a block of lines, apart by blanks, the first of which is line
    `first` of the file, blank ones left out; raises CaseError at the line that holds another count
    of them, or something else.
    """
    if not block or block.isspace():
        return np.empty((0, width))
    try:
        table = np.loadtxt(io.BytesIO(block), comments=None, ndmin=2)
    except (ValueError, OverflowError) as error:
        refuse(block, [True] * width, path, first, str(error))
    if table.shape[1] != width:
        refuse(block, [True] * width, path, first, f"{table.shape[1]} columns")
    return table


def parsed(
    block: bytes,
    numeric: Sequence[bool],
    path: Path,
    first: int,
    separator: str | None = None,
    decimal: str = ".",
) -> pandas.DataFrame:
    """The table in a block of lines, its columns counted from 0; what is not `numeric` stays text.
    Blanks separate where there is no `separator`. Raises CaseError as `numbers` does.
    """
    try:
        table = pandas.read_csv(
            io.BytesIO(block),
            engine="c",
            header=None,
            sep=separator or r"\s+",
            decimal=decimal,
            dtype={i: float if one else str for i, one in enumerate(numeric)},
            float_precision="round_trip",
            skip_blank_lines=True,
            skipinitialspace=True,
            encoding_errors="replace",
            quoting=0 if separator else 3,
        )
    except (ValueError, OverflowError) as error:  # pandas' own errors are ValueErrors
        refuse(block, numeric, path, first, str(error), separator, decimal)
    if table.shape[1] != len(numeric):
        refuse(block, numeric, path, first, f"{table.shape[1]} columns", separator, decimal)
    values = table.loc[:, [i for i, one in enumerate(numeric) if one]]
    if np.isnan(values.to_numpy()).any():  # a value that lacks, or one that is nan
        check(block, numeric, path, first, separator, decimal)
    return table


def refuse(
    block: bytes,
    numeric: Sequence[bool],
    path: Path,
    first: int,
    why: str,
    separator: str | None = None,
    decimal: str = ".",
) -> NoReturn:
    """Raises CaseError at the line that is wrong, else for `why`."""
    check(block, numeric, path, first, separator, decimal)
    raise CaseError(f"{path}:{first}: the rows cannot be read ({' '.join(why.split())})")


def words(line: bytes, separator: str | None) -> list[str]:
    """The values in a line."""
    text = line.decode(errors="replace").rstrip("\r\n")
    return text.split() if separator is None else fields(text, separator) or [""]


def fields(text: str, separator: str) -> list[str]:
    """The values in a line, some perhaps in quotes; what no table holds is split as it stands."""
    try:
        found: list[str] = next(csv.reader([text], delimiter=separator, skipinitialspace=True), [])
    except csv.Error:  # an end of line within a line, a value without an end
        found = text.split(separator)
    return [word.strip() for word in found]


def check(
    block: bytes,
    numeric: Sequence[bool],
    path: Path,
    first: int,
    separator: str | None,
    decimal: str,
) -> None:
    """Raises CaseError unless each line holds as many values as `numeric`, numbers where it says;
    lines may be blank.
    """
    for at, line in enumerate(block.removesuffix(b"\n").split(b"\n"), start=first):
        if not line.strip():
            continue
        values, where = words(line, separator), f"{path}:{at}"
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
