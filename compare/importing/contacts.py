"""Contacts joined with their grains: who touches whom, where, and with which force on the first.

Units and axes are those of the grains they are joined with: SI, the file's axes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cases.errors import CaseError
from compare.importing import lattice
from compare.importing.merge import Instant
from compare.importing.series import Grains
from compare.importing.spool import Piece, Spool
from compare.importing.units import Units

OTHER_WALL = -6  # second of a contact with a wall that the file does not number
SURE = 0.5  # share of the forces times branches that must have one sign to tell it
APART = 2.0  # sums of radii: beyond it no force of contact, or of a liquid bridge, acts
SAME = 0.9  # share of a frame's pairs that a later file repeats
NEEDED = ("first", "second", "fx", "fy", "fz")


@dataclass
class Contacts:
    """Of one instant: ids (C,), `second` negative for walls; vectors (C, 3): branch from the second
    centre (of a wall, the contact point) to the first [m], point [m], force on the first [N];
    `power` dissipated (C,) [W] or None.
    """

    first: np.ndarray
    second: np.ndarray
    branch: np.ndarray
    point: np.ndarray
    force: np.ndarray
    power: np.ndarray | None


@dataclass
class Joiner:
    """Finds the contacts of an instant. `apart` are pieces of files that hold contacts alone;
    `walls` (3, 2) are places of plane walls in the file's axes [m], NaN where there is none.
    """

    spool: Spool
    units: Units
    apart: Sequence[Piece]
    instants: Sequence[Instant]
    walls: np.ndarray
    shift: int  # added to ids that are not negative, where those of the grains start at 0
    notes: list[str]
    sign: float = 0.0  # of the file's forces, told by the first frame that has contacts
    said: set[str] = field(default_factory=set)

    def __post_init__(self):
        self.groups = grouped(self.apart, self.instants, self.notes)

    def of(self, k: int, grains: Grains) -> Contacts | None:
        """Those of the instant k; None where there are none told."""
        pieces = [one for one in self.instants[k].pieces if one.contacts is not None]
        pieces += self.groups.get(k, [])
        if not pieces:
            return None
        told = [self.units.columns(self.spool.contacts(piece)) for piece in pieces]
        return self.joined(pieces[0].source, self.latest(told), grains)

    def latest(self, told: list[dict]) -> list[dict]:
        """Without those that a later file repeats, as after a restart; processes share few."""
        kept: list[dict] = []
        for one in reversed(told):
            pairs = pairs_of(one)
            if any(len(pairs) and np.isin(pairs, pairs_of(other)).mean() > SAME for other in kept):
                self.once_said("merged: of contacts that are there twice the later file's count")
            else:
                kept.insert(0, one)
        return kept

    def joined(self, source: str, told: list[dict], grains: Grains) -> Contacts:
        names = set.intersection(*(set(one) for one in told))
        lacking = [name for name in NEEDED if name not in names]
        if lacking:
            raise CaseError(
                f"{source}: contacts without {', '.join(lacking)} name the columns: --contacts "
                '"first=1,second=2,fx=…"'
            )
        all_of = {name: np.concatenate([one[name] for one in told]) for name in names}
        first, second = (self.numbers(source, all_of[name]) for name in ("first", "second"))
        swapped = first < 0  # a wall that stands first
        first, second = np.where(swapped, second, first), np.where(swapped, first, second)
        rows = found(source, first, grains)
        others = found(source, np.where(second < 0, first, second), grains)
        turn = np.where(swapped, -1.0, 1.0)[:, None]
        force = turn * stacked(all_of, "fx", "fy", "fz")
        if not np.isfinite(force).all():
            raise CaseError(f"{source}: a contact's force is no number")
        box, wall = grains.box, second < 0
        branch = lattice.nearest(grains.place[rows] - grains.place[others], box)
        if {"bx", "by", "bz"} <= names:
            branch = np.where(wall[:, None], turn * stacked(all_of, "bx", "by", "bz"), branch)
        self.refuse_far(source, first, second, branch, grains, rows, others)
        share = grains.radius[rows] / (grains.radius[rows] + grains.radius[others])
        point = grains.place[rows] - share[:, None] * branch
        told_point = stacked(all_of, "px", "py", "pz") if {"px", "py", "pz"} <= names else None
        if told_point is not None:
            offset = lattice.nearest(told_point - grains.place[rows], box)
            point = grains.place[rows] + offset
            branch = np.where(wall[:, None], -offset, branch)
        elif wall.any() and not {"bx", "by", "bz"} <= names:
            branch[wall] = self.onto_walls(grains, rows[wall], force[wall])
        point = np.where(wall[:, None] & (told_point is None), grains.place[rows] - branch, point)
        power = all_of.get("power")
        out = Contacts(first, second, branch, point, force, power)
        out = once(source, out, self.once_said)
        return self.signed(source, out)

    def refuse_far(self, source, first, second, branch, grains, rows, others):
        """Raises CaseError where grains that are said to touch are apart."""
        touching = grains.radius[rows] + grains.radius[others]
        length = np.linalg.norm(branch, axis=1)
        apart = (second > 0) & (length > APART * touching) & (first != second)
        if apart.any():
            k = int(np.argmax(apart))
            raise CaseError(
                f"{source}: grains {first[k]} and {second[k]} touch, but are {length[k]:.4g} m "
                f"apart, their radii sum to {touching[k]:.4g} m (another instant, or a periodic "
                "box that is not told?)"
            )

    def numbers(self, source: str, values: np.ndarray) -> np.ndarray:
        """Ids of grains, and negative numbers of walls."""
        ids = np.rint(values).astype(np.int64)
        if np.any(ids != values):
            raise CaseError(f"{source}: a contact's id is {values[ids != values][0]:g}")
        ids = np.where(ids >= 0, ids + self.shift, ids)
        return np.where(ids == 0, OTHER_WALL, ids)

    def onto_walls(self, grains: Grains, rows: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Branches (W, 3) of contacts with walls: to the nearest plane wall within a radius and a
        half, else against the force.
        """
        place, radius = grains.place[rows], grains.radius[rows]
        far = np.abs(place[:, :, None] - self.walls).reshape(len(rows), 6)
        far = np.where(np.isnan(far), np.inf, far)
        which = np.argmin(far, axis=1)
        near = far[np.arange(len(rows)), which]
        out = np.zeros_like(place)
        out[np.arange(len(rows)), which // 2] = np.where(which % 2 == 0, near, -near)
        size = np.linalg.norm(force, axis=1, keepdims=True)
        unit = np.divide(force, size, out=np.zeros_like(force), where=size > 0.0)
        plane = near < 1.5 * radius
        if not plane.all():
            self.once_said("assumed: contacts with walls are where their force points from")
        return np.where(plane[:, None], out, radius[:, None] * unit)

    def signed(self, source: str, contacts: Contacts) -> Contacts:
        """The force on the first: grains that touch repel each other."""
        if self.sign == 0.0:
            grains = contacts.second > 0
            work = np.sum(contacts.force * contacts.branch, axis=1)[grains]
            size = np.abs(work).sum()
            share = work.sum() / size if size > 0.0 else 0.0
            self.sign = -1.0 if share < -SURE else 1.0
            if share < -SURE:
                self.notes.append("turned: the file has the forces on the second of two grains")
            elif share < SURE and size > 0.0:
                self.notes.append(
                    f"assumed: forces are on the first of two grains ({source} has repulsion in "
                    f"{50 * (1 + share):.0f} % only)"
                )
        if self.sign < 0.0:
            contacts.force = -contacts.force
        return contacts

    def once_said(self, note: str):
        if note not in self.said:
            self.said.add(note)
            self.notes.append(note)


def pairs_of(columns: dict[str, np.ndarray]) -> np.ndarray:
    """A number for each pair of ids (C,)."""
    if not {"first", "second"} <= columns.keys():
        return np.empty(0)
    return columns["first"] + 1j * columns["second"]


def stacked(columns: dict[str, np.ndarray], *names: str) -> np.ndarray:
    return np.stack([columns[name] for name in names], axis=-1)


def found(source: str, ids: np.ndarray, grains: Grains) -> np.ndarray:
    """Rows (C,) of ids; raises CaseError with one that no grain has."""
    rows = np.searchsorted(grains.ids, ids).clip(0, len(grains.ids) - 1)
    strange = grains.ids[rows] != ids
    if strange.any():
        raise CaseError(
            f"{source}: a contact of grain {ids[strange][0]}, which {grains.source} lacks (of "
            "another instant?)"
        )
    return rows


def once(source: str, contacts: Contacts, say) -> Contacts:
    """Each contact once: two processes, or both grains, may have told it; a grain that touches its
    own image is left out.
    """
    low = np.minimum(contacts.first, contacts.second)
    high = np.maximum(contacts.first, contacts.second)
    _, index, count = np.unique(
        np.stack([low, high], axis=1), axis=0, return_index=True, return_counts=True
    )
    own = contacts.first == contacts.second
    keep = np.ones(len(own), bool)
    grains = contacts.second > 0
    keep[np.setdiff1d(np.flatnonzero(grains), index)] = False
    keep &= ~own
    if keep.all():
        return contacts
    if own.any():
        say(f"dropped: contacts of grains with their own images ({source})")
    if np.any(count > 1):
        say(f"dropped: contacts of two grains that are told twice ({source})")
    power = None if contacts.power is None else contacts.power[keep]
    return Contacts(
        contacts.first[keep],
        contacts.second[keep],
        contacts.branch[keep],
        contacts.point[keep],
        contacts.force[keep],
        power,
    )


def grouped(
    apart: Sequence[Piece], instants: Sequence[Instant], notes: list[str]
) -> dict[int, list[Piece]]:
    """Pieces of contacts by the instant they belong to: by step, else by time, else in order."""
    groups: dict[int, list[Piece]] = {}
    steps = {one.pieces[0].step: k for k, one in enumerate(instants)}
    times = {one.time: k for k, one in enumerate(instants)}
    left = 0
    if any(one.step is None and one.time is None for one in apart):
        if len(apart) != len(instants):
            raise CaseError(
                f"{apart[0].source}: contacts without a step ({len(apart)} frames of contacts, "
                f"{len(instants)} of grains) give one for each frame"
            )
        if len(apart) > 1:
            notes.append("assumed: contacts are in the order of the frames (they tell no step)")
        return {k: [piece] for k, piece in enumerate(apart)}
    for piece in apart:
        k = steps.get(piece.step) if piece.step is not None else times.get(piece.time)
        if k is None:
            left += 1
        else:
            groups.setdefault(k, []).append(piece)
    if left:
        notes.append(f"dropped: {left} frames of contacts whose instant has no grains")
    if apart and not groups:
        raise CaseError(
            f"{apart[0].source}: contacts of other instants than the grains (step "
            f"{apart[0].step}) give the frames of the same steps"
        )
    return groups
