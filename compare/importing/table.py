"""Rows of numbers in columns, as text."""

import io
from collections.abc import Collection
from typing import NoReturn

import numpy as np

from cases.errors import CaseError

WORD = 8  # characters that are kept of a word: it is only looked at, never used


def is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return b"_" not in word  # Python's own way to group digits


def columns(
    block: bytes, names: list[str], rows: int, place: tuple[str, int], text: Collection[str] = ()
) -> dict[str, np.ndarray]:
    """The numeric columns of `rows` rows that stand in `block`, each (rows,), float64; of columns
    of one name the first. Columns of words are left out: those in `text`, and those whose first
    and last word are none. `place` is the file and the number of the block's first line. Raises
    CaseError with the line where a row has another number of words or a word is no number.
    """
    first, last = (row.split() for row in ends(block))
    words = [
        name in text or (i < min(len(first), len(last)) and not is_number_in(first[i], last[i]))
        for i, name in enumerate(names)
    ]
    if rows == 0:
        return {name: np.empty(0) for name in names if name not in text}
    if not first:
        refuse(block, names, words, place)
    kinds = np.dtype([(str(i), f"S{WORD}" if word else "f8") for i, word in enumerate(words)])
    try:
        table = np.loadtxt(io.BytesIO(block), kinds, comments=None, encoding="latin-1", ndmin=1)
    except (ValueError, OverflowError) as error:
        refuse(block, names, words, place, str(error))
    if table.size != rows:
        refuse(block, names, words, place, f"{table.size} rows where {rows} are said to be")
    by_name: dict[str, np.ndarray] = {}
    for i, (name, word) in enumerate(zip(names, words)):
        if name not in by_name and not word:
            by_name[name] = table[str(i)].copy()
    return by_name


def ends(block: bytes) -> tuple[bytes, bytes]:
    """The first and the last line of a block."""
    whole = block.rstrip(b"\r\n")
    return block[: block.find(b"\n") + 1 or None], whole[whole.rfind(b"\n") + 1 :]


def is_number_in(*words: bytes) -> bool:
    return any(is_number(word) for word in words)


def refuse(
    block: bytes, names: list[str], words: list[bool], place: tuple[str, int], why: str = ""
) -> NoReturn:
    """Raises CaseError for the first row that is not as it should be, else for `why`."""
    path, start = place
    for number, line in enumerate(block.removesuffix(b"\n").split(b"\n"), start):
        row = line.split()
        if len(row) != len(names):
            raise CaseError(
                f"{path}:{number}: {len(row)} words for {len(names)} columns ({' '.join(names)})"
            )
        for word, name, is_word in zip(row, names, words):
            if not is_word and not is_number(word):
                shown = word.decode("utf-8", "replace")
                raise CaseError(f"{path}:{number}: {shown!r} is no number (column {name})")
    raise CaseError(f"{path}:{start}: rows that cannot be read ({why})")
