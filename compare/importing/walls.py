"""Which grains are wall: by type, by id, or because they never move while others do."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cases.errors import CaseError
from compare.importing.series import Grains, Series

STILL = 1e-6  # of a radius: what a place that is written twice may differ by


@dataclass(frozen=True)
class Chosen:
    """How wall grains are told: types, ranges of ids (both ends belong to them), and whether grains
    that never move are wall.
    """

    types: tuple[int, ...] = ()
    ids: tuple[tuple[int, int], ...] = ()
    frozen: bool = True

    def named(self, grains: Grains) -> np.ndarray:
        """(N,): whether a grain is wall by its type or id."""
        wall = np.zeros(len(grains.ids), bool)
        for low, high in self.ids:
            wall |= (grains.ids >= low) & (grains.ids <= high)
        if self.types:
            if grains.type is None:
                raise CaseError(f"{grains.source}: no column type (--wall-type) give --wall-id")
            wall |= np.isin(grains.type, self.types)
        return wall


def ids(series: Series, chosen: Chosen, notes: list[str]) -> np.ndarray:
    """Ids of all wall grains, in order. Raises CaseError where none is of a type or id that was
    given, or all are.
    """
    found: set[int] = set()
    if chosen.types or chosen.ids:
        for grains in series:
            found.update(grains.ids[chosen.named(grains)].tolist())
        if not found:
            raise CaseError(f"{series[0].source}: no grain is of --wall-type or --wall-id")
    elif chosen.frozen:
        found.update(frozen(series, notes).tolist())
    wall = np.array(sorted(found), dtype=np.int64)
    if np.all(np.isin(series[0].ids, wall)):
        raise CaseError(f"{series[0].source}: all grains are wall grains (none is left to map)")
    if len(wall):
        how = "of the type or id given" if chosen.types or chosen.ids else "never move"
        notes.append(f"walls: {len(wall)} grains {how}: part of the wall")
    return wall


def frozen(series: Series, notes: list[str]) -> np.ndarray:
    """Ids of the grains that are in every frame, at the same place and with velocity zero, while
    others move.
    """
    first = series[0]
    if len(series) < 2 or first.velocity is None:
        why = "of one frame" if len(series) < 2 else "without velocities"
        notes.append(f"walls: none, since {why} nobody tells which grains never move{hint(first)}")
        return np.array([], dtype=np.int64)
    still = np.ones(len(first.ids), bool)
    for grains in series:
        rows, there = located(first.ids, grains.ids)
        still &= there
        far = np.abs(grains.place[rows] - first.place).max(axis=1)
        assert grains.velocity is not None
        moving = np.any(grains.velocity[rows] != 0.0, axis=1)
        still &= (far <= STILL * first.radius) & ~moving
        if not still.any():
            return np.array([], dtype=np.int64)
    if still.all():
        notes.append("walls: none, since nothing moves")
        return np.array([], dtype=np.int64)
    return first.ids[still]


def located(wanted: np.ndarray, ids: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows (N,) of the wanted ids among sorted ids, and whether each is there (else row 0)."""
    rows = np.searchsorted(ids, wanted).clip(0, len(ids) - 1)
    there = ids[rows] == wanted
    return np.where(there, rows, 0), there


def hint(grains: Grains) -> str:
    """What to give where grains of a type of their own are at rest."""
    if grains.type is None or grains.velocity is None:
        return ""
    moving = np.any(grains.velocity != 0.0, axis=1)
    resting = sorted(set(grains.type[~moving].tolist()) - set(grains.type[moving].tolist()))
    if not resting or not moving.any():
        return ""
    words = " ".join(f"{one:g}" for one in resting)
    count = int(np.isin(grains.type, resting).sum())
    return f" (the {count} of type {words} are at rest: --wall-type {words} makes them wall)"


def kept(wall: np.ndarray, found: Sequence[int] | np.ndarray) -> np.ndarray:
    """(N,): whether ids are wall."""
    return np.isin(found, wall, assume_unique=True)
