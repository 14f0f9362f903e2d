"""Frames in the order of time: parts of several processes joined, repetitions after a restart told
apart from them, and each grain's id once.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cases.errors import CaseError
from compare.importing.spool import Piece, Spool


@dataclass(frozen=True)
class Instant:
    """One instant: the pieces that together hold its grains. `step` is unique and grows."""

    step: int
    time: float | None
    pieces: tuple[Piece, ...]

    @property
    def source(self) -> str:
        return self.pieces[0].source


def instants(spool: Spool, pieces: Sequence[Piece], notes: list[str]) -> list[Instant]:
    """All instants in their order. Raises CaseError where pieces of one instant share some of their
    grains, or ids do not tell grains apart.
    """
    names, numbered = keys(pieces, notes)
    groups: dict[float, list[Piece]] = {}
    repeated: list[str] = []
    for name, piece in zip(names, pieces):
        joined(spool, groups.setdefault(name, []), piece, repeated)
    if repeated:
        more = f" and {len(repeated) - 1} more" if len(repeated) > 1 else ""
        notes.append(
            "merged: of a frame that is there twice the later one counts, unless the box is told "
            f"by the other alone ({repeated[0]}{more})"
        )
    parts = max((len(group) for group in groups.values()), default=1)
    if parts > 1:
        notes.append(f"merged: frames of up to {parts} parts each")
    found = []
    for number, name in enumerate(sorted(groups)):
        group = groups[name]
        step = int(name) if numbered else number
        times = {piece.time for piece in group if piece.time is not None}
        if len(times) > 1:
            raise CaseError(f"{group[-1].source}: step {step} at another time than elsewhere")
        found.append(Instant(step, next(iter(times), None), tuple(group)))
    refuse_unnamed(found)
    return found


def keys(pieces: Sequence[Piece], notes: list[str]) -> tuple[list[float], bool]:
    """What orders each piece, and whether these are steps: else times, or where there are none the
    order of the files.
    """
    steps, times = ([getattr(one, name) for one in pieces] for name in ("step", "time"))
    if all(step is not None for step in steps):
        if min(steps) < 0:
            raise CaseError(f"{pieces[int(np.argmin(steps))].source}: a negative step")
        return steps, True
    if all(time is not None for time in times):
        return times, False
    if any(step is not None or time is not None for step, time in zip(steps, times)):
        first = next(piece for piece in pieces if piece.step is None)
        raise CaseError(f"{first.source}: no step (other frames have one) import them apart")
    if len(pieces) > 1:
        notes.append("assumed: frames are in the order of the files (they tell no step, no time)")
    return list(range(len(pieces))), False


def joined(spool: Spool, group: list[Piece], piece: Piece, repeated: list[str]):
    """Puts a piece into the group of its instant."""
    if not group:
        group.append(piece)
        return
    where = f"{piece.source}: step {piece.step if piece.step is not None else piece.time}"
    if any("id" not in one.columns for one in (*group, piece)):
        raise CaseError(f"{where} is there twice, without ids (which count?) give one of them")
    mine = np.sort(spool.column(piece, "id"))
    others = [np.sort(spool.column(one, "id")) for one in group]
    if len(others) > 1 and np.array_equal(np.sort(np.concatenate(others)), mine):
        group[:] = [piece]
        repeated.append(where)
        return
    for k, ids in enumerate(others):
        shared = np.intersect1d(ids, mine)
        if np.array_equal(ids, mine):
            if piece.box is not None or group[k].box is None:  # a dump tells more than VTK
                group[k] = piece
            repeated.append(where)
            return
        if len(shared):
            raise CaseError(
                f"{where}: grain {int(shared[0])} is in {group[k].source} too, but others are not "
                "(neither another part of the frame nor its repetition) give one of them"
            )
    group.append(piece)


def refuse_unnamed(found: Sequence[Instant]):
    """Without ids grains are told by their rows, of which there must be as many in each frame."""
    counts = {one.pieces[0].count for one in found if "id" not in one.pieces[0].columns}
    if len(counts) > 1:
        raise CaseError(
            f"{found[-1].source}: no ids, and the number of grains changes (which are gone?) "
            "have the ids written"
        )


def ids_of(spool: Spool, instant: Instant) -> tuple[np.ndarray, np.ndarray | None]:
    """Ids (N,) in order, and the rows of the joined pieces in that order, None where they are so
    already. Raises CaseError with an id that is no whole number, or is there twice.
    """
    if "id" not in instant.pieces[0].columns:
        return np.arange(1, instant.pieces[0].count + 1), None
    values = np.concatenate([spool.column(piece, "id") for piece in instant.pieces])
    ids = np.rint(np.nan_to_num(values, nan=0.5)).astype(np.int64)
    if np.any(wrong := ids != values):
        raise CaseError(f"{instant.source}: id {values[wrong][0]:g} (no whole number)")
    order = np.argsort(ids, kind="stable") if len(instant.pieces) > 1 else None
    ids = ids if order is None else ids[order]
    twice = np.unique(ids[1:][ids[1:] == ids[:-1]])
    if len(twice):
        more = f", and {len(twice) - 1} more ids" if len(twice) > 1 else ""
        raise CaseError(f"{instant.source}: grain {twice[0]} is there twice{more}")
    if len(ids) and ids[0] < 0:
        raise CaseError(f"{instant.source}: id {ids[0]} (negative ones mean walls)")
    return ids, order
