"""Lines of a text file that are counted, and blocks of them."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np

from cases.errors import CaseError
from compare.importing import compressed

PIECE = 1 << 20  # bytes read at a time
LONGEST = 1 << 24  # bytes of a line: what has longer ones is no text
MARK = b"ITEM: "  # starts a section of a dump: no row holds it


class Incomplete(CaseError):
    """The file ends, or goes on with something else, before what it began is whole."""


class Lines:
    """Reads a stream of bytes; `number` is that of the line last read, from 1. `ended` tells
    whether it had an end of line, `cut` that the compressed stream broke off.
    """

    def __init__(self, path: Path, stream: BinaryIO):
        self.path, self._stream = path, stream
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

    def line(self) -> str | None:
        """The next line without its end; None where the file ends."""
        while (end := self._held.find(b"\n", self._at)) < 0 and self._more():
            pass
        self.ended = end >= 0
        if not self.ended and self._at == len(self._held):
            return None
        stop = end if self.ended else len(self._held)
        text = self._held[self._at : stop].decode("utf-8", "replace")
        self._last, self._at = self._at, stop + self.ended
        self.number += 1
        return text.rstrip("\r")

    def back(self) -> None:
        """Unreads the line last read, up to the MARK in it."""
        self._at = max(self._last, self._held.find(MARK, self._last, self._at))
        self.number -= 1

    def skip_to_mark(self) -> None:
        """On to the next line that holds a MARK, if there is any."""
        while (text := self.line()) is not None:
            if MARK.decode() in text:
                self.back()
                return

    def rows(self, count: int) -> bytes:
        """The next `count` lines in one block; fewer where the file ends or a MARK comes."""
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
            mark = self._held.find(MARK, self._at, whole)
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
def opened(path: Path) -> Iterator[Lines]:
    """The lines of a file, compressed or not; raises CaseError where it cannot be read."""
    with compressed.opened(path) as stream:
        yield Lines(path, stream)
