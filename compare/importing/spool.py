"""What readers gave, kept aside column by column until all of it is known.

Frames are written once, as they are read, and read back as often as needed: text is parsed once,
and one frame is in memory at a time.
"""

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compare.importing.frame import SCALARS, VECTORS, Box, Frame

IMAGES = ("ix", "iy", "iz")  # how often a grain has left a periodic box
KEPT = {*VECTORS["position"], *VECTORS["velocity"], *VECTORS["spin"], *SCALARS, *IMAGES}


@dataclass(frozen=True)
class Piece:
    """A frame, or one process' part of it, as a file holds it: without its columns."""

    number: int
    source: str
    step: int | None
    time: float | None
    box: Box | None
    units: str | None
    columns: tuple[str, ...]
    contacts: tuple[str, ...] | None
    count: int
    least: float | None  # id


class Spool:
    """Pieces in the order in which they came, each in the order of its ids; columns that no grains'
    file needs are not kept.
    """

    def __init__(self, folder: Path):
        self.folder = folder
        self.pieces: list[Piece] = []

    def add(self, frame: Frame):
        number = len(self.pieces)
        kept = {name: values for name, values in frame.columns.items() if name in KEPT}
        ids = kept.get("id", np.empty(0))
        order = None if np.all(ids[1:] >= ids[:-1]) else np.argsort(ids, kind="stable")
        for name, values in kept.items():
            values = values if order is None else values[order]
            self.save(self.place(number, name), values)
        for name, values in (frame.contacts or {}).items():
            self.save(self.place(number, f"contact.{name}"), values)
        self.pieces.append(
            Piece(
                number,
                frame.source,
                frame.step,
                frame.time,
                frame.box,
                frame.units,
                tuple(kept),
                None if frame.contacts is None else tuple(frame.contacts),
                len(next(iter(kept.values()), ())),
                float(ids.min()) if len(ids) else None,
            )
        )

    @staticmethod
    def save(path: Path, values: np.ndarray):
        """Raises OSError that says why, which NumPy's own way to a file does not."""
        data = io.BytesIO()
        np.save(data, values)
        path.write_bytes(data.getbuffer())

    def place(self, number: int, name: str) -> Path:
        return self.folder / f"{number}.{name}.npy"

    def column(self, piece: Piece, name: str) -> np.ndarray:
        """Values (N,) in the file's own units."""
        return np.load(self.place(piece.number, name))

    def contacts(self, piece: Piece) -> dict[str, np.ndarray]:
        """By name, each (C,)."""
        names = piece.contacts or ()
        return {name: np.load(self.place(piece.number, f"contact.{name}")) for name in names}
