"""Instants of a file's grains in SI and in the file's axes, loaded one at a time."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from cases.errors import CaseError
from compare.importing import lattice
from compare.importing.frame import VECTORS, Box
from compare.importing.merge import Instant, ids_of
from compare.importing.spool import IMAGES, Spool
from compare.importing.units import Units

FINITE = ("position", "velocity", "spin")


@dataclass
class Grains:
    """All grains of one instant, in the order of their ids: vectors (N, 3), scalars (N,), SI.

    What the file does not tell is None; `place` is inside a periodic box, `way` the place without
    the jumps through its faces, which image flags tell.
    """

    source: str
    step: int
    box: Box | None
    ids: np.ndarray
    place: np.ndarray
    way: np.ndarray | None
    velocity: np.ndarray | None
    spin: np.ndarray | None
    radius: np.ndarray
    mass: np.ndarray | None
    density: np.ndarray | None
    type: np.ndarray | None

    @property
    def volume(self) -> np.ndarray:
        """[m3]"""
        return 4.0 / 3.0 * np.pi * self.radius**3


class Series(Sequence[Grains]):
    """`diameter` [m] is that of all grains where the file has no radii, `box` that of all frames
    where they have none, in the file's units.
    """

    def __init__(
        self,
        spool: Spool,
        instants: list[Instant],
        units: Units,
        diameter: float | None = None,
        box: Box | None = None,
    ):
        self.spool, self.instants, self.units = spool, instants, units
        self.diameter, self.box = diameter, box
        least = [one.least for part in instants for one in part.pieces if one.least is not None]
        self.first_id = 0 if least and min(least) == 0.0 else 1

    def __len__(self) -> int:
        return len(self.instants)

    def __iter__(self) -> Iterator[Grains]:
        return (self[k] for k in range(len(self)))

    def __getitem__(self, k):
        instant = self.instants[k]
        ids, order = ids_of(self.spool, instant)
        told = self.columns(instant, order)
        vectors = {
            name: np.stack([told[axis] for axis in axes], axis=-1) if axes[0] in told else None
            for name, axes in VECTORS.items()
            if name in FINITE
        }
        images = np.stack([told[i] for i in IMAGES], -1) if set(IMAGES) <= told.keys() else None
        box = self.units.box(instant.pieces[0].box or self.box)
        radius = self.radii(instant, told, len(ids))
        for name, values in (vectors | {"radius": radius} | scalars(told)).items():
            refuse_unusable(instant, ids, name, values)
        place = lattice.wrapped(vectors["position"], box)
        return Grains(
            instant.source,
            instant.step,
            box,
            ids + (1 - self.first_id if self.first_id == 0 else 0),
            place,
            None if images is None else lattice.unfolded(vectors["position"], images, box),
            vectors["velocity"],
            vectors["spin"],
            radius,
            told.get("mass"),
            told.get("density"),
            told.get("type"),
        )

    def columns(self, instant: Instant, order: np.ndarray | None) -> dict[str, np.ndarray]:
        """Columns of the joined pieces in SI, rows in `order` where it is given, id left out."""
        names = set(instant.pieces[0].columns)
        for piece in instant.pieces[1:]:
            if set(piece.columns) != names:
                odd = ", ".join(sorted(names ^ set(piece.columns)))
                raise CaseError(f"{piece.source}: other columns than its frame's parts ({odd})")
        lacking = [axis for axis in VECTORS["position"] if axis not in names]
        if lacking:
            raise CaseError(f"{instant.source}: no column {', '.join(lacking)} (positions)")
        for axes in VECTORS.values():
            given = names & set(axes)
            if given and given != set(axes) and axes != VECTORS["stress"]:
                lacking = [axis for axis in axes if axis not in names]
                raise CaseError(f"{instant.source}: no column {', '.join(lacking)}")
        told = {}
        for name in names - {"id"}:
            parts = [self.spool.column(piece, name) for piece in instant.pieces]
            values = np.asarray(parts[0] if len(parts) == 1 else np.concatenate(parts), float)
            told[name] = values if order is None else values[order]
        return self.units.columns(told)

    def radii(self, instant: Instant, told: dict, count: int) -> np.ndarray:
        if "radius" in told:
            return told["radius"]
        if self.diameter is None:
            raise CaseError(
                f"{instant.source}: no column radius or diameter (how large are the grains?) have "
                "it written, or give --diameter where all are alike"
            )
        return np.full(count, 0.5 * self.diameter)


def scalars(told: dict) -> dict[str, np.ndarray]:
    return {name: told[name] for name in ("mass", "density") if name in told}


def refuse_unusable(instant: Instant, ids: np.ndarray, name: str, values: np.ndarray | None):
    """Raises CaseError with the id of a grain whose values are no number, or not positive."""
    if values is None:
        return
    wrong = ~np.isfinite(values).reshape(len(ids), -1).all(axis=1)
    what = "no number"
    if not wrong.any() and name in ("radius", "mass", "density"):
        wrong, what = values <= 0.0, "not positive"
    if wrong.any():
        k = int(np.argmax(wrong))
        number = f": {values[k]:g}" if values.ndim == 1 else ""
        raise CaseError(f"{instant.source}: grain {ids[k]}: {name} is {what}{number}")
