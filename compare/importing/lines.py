"""Lines of a text file that are counted, and blocks of them."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np

from cases.errors import CaseError, Failure
from compare.importing import compressed
from compare.importing.frame import note

PIECE = 1 << 20  # bytes read at a time
LONGEST = 1 << 24  # bytes of a line: what has longer ones is no text
ALL = 1 << 62  # lines


SKIP = " --skip-incomplete leaves out what is not whole"


class Incomplete(CaseError):
    """The file ends, or goes on with something else, before what it began is whole."""

    def __init__(self, line: str, code: Failure | None = None):
        super().__init__(line.removesuffix(SKIP) + SKIP, code)

    @property
    def told(self) -> str:
        """The line without what to give."""
        return str(self).removesuffix(SKIP)


def drop(error: Incomplete, options: dict) -> None:
    """Notes what is left out, where that is asked for; else raises the error."""
    if options.get("incomplete") != "drop":
        raise error
    note(options, f"{error.told}: left out")


class Lines:
    """Reads a stream of bytes; `number` is that of the line last read, from 1. `ended` tells
    whether it had an end of line, `cut` that the compressed stream broke off. A `mark` starts a
    section of the file: no row holds it.
    """

    def __init__(self, path: Path, stream: BinaryIO, mark: bytes = b""):
        self.path, self.mark, self._stream = path, mark, stream
        self.number, self.ended, self.cut = 0, True, False
        self._held, self._at, self._last = b"", 0, 0

    def where(self) -> str:
        return f"{self.path}:{self.number}"

    def _more(self) -> bool:
        """Takes another piece in; whether there was one."""
        if len(self._held) - self._at > LONGEST:
            raise CaseError(f"{self.path}:{self.number + 1}: a line without an end (no text file?)")
        try:
            # read1: of a stream that breaks off, what came before is still handed over
            piece = b"" if self.cut else self._stream.read1(PIECE)  # type: ignore[attr-defined]
        except EOFError:
            piece, self.cut = b"", True
        self._held, self._at = self._held[self._at :] + piece, 0
        return bool(piece)

    def next(self) -> bytes:
        """The next line with its end; empty where the file ends."""
        while (end := self._held.find(b"\n", self._at)) < 0 and self._more():
            pass
        self.ended = end >= 0
        line = self._held[self._at : end + 1 if self.ended else len(self._held)]
        self._last, self._at = self._at, self._at + len(line)
        self.number += bool(line)
        return line

    def peek(self) -> bytes:
        """The next line, not yet read."""
        line = self.next()
        self._at, self.number = self._last, self.number - bool(line)
        return line

    def line(self) -> str | None:
        """The next line without its end; None where the file ends."""
        line = self.next()
        return line.decode("utf-8", "replace").rstrip("\r\n") if line else None

    def back(self) -> None:
        """Unreads the line last read, up to the mark in it."""
        self._at = max(self._last, self._held.find(self.mark, self._last, self._at))
        self.number -= 1

    def refuse_cut(self) -> None:
        """At the end: raises Incomplete where the compressed stream broke off."""
        if self.cut:
            raise Incomplete(f"{self.where()}: the compressed stream breaks off here (cut short?)")

    def skip_to_mark(self) -> None:
        """On to the next line that holds a mark, if there is any."""
        while line := self.next():
            if self.mark in line:
                self.back()
                return

    def rows(self, count: int = ALL) -> bytes:
        """The next `count` lines in one block; fewer where the file ends or a mark comes."""
        pieces: list[bytes] = []
        self.ended = True
        while count > 0:
            whole = self._held.rfind(b"\n") + 1
            if whole <= self._at:
                if self._more():
                    continue
                if self._at == len(self._held):
                    break
                whole, self.ended = len(self._held), False
            mark = self._held.find(self.mark, self._at, whole) if self.mark else -1
            block = self._held[self._at : whole if mark < 0 else mark]
            lines = block.count(b"\n")
            if lines >= count:
                ends = np.flatnonzero(np.frombuffer(block, np.uint8) == ord("\n"))
                block, lines = block[: ends[count - 1] + 1], count
            pieces.append(block)
            self._at += len(block)
            torn = bool(block) and not block.endswith(b"\n")
            self.number += lines + (torn and mark < 0)
            count -= lines
            if mark >= 0 or not self.ended:
                break
        return b"".join(pieces)


@contextmanager
def opened(path: Path, mark: bytes = b"") -> Iterator[Lines]:
    """The lines of a file, compressed or not; raises CaseError where it cannot be read."""
    with compressed.opened(path) as stream:
        yield Lines(path, stream, mark)
