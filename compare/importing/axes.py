"""Axes of another program turned into ours: x along the flow, y up, z across, right-handed.

A turn is a proper rotation, so vectors and pseudo-vectors, such as spins, turn alike.
"""

from dataclasses import dataclass

import numpy as np

from cases.errors import CaseError
from compare.importing.frame import Box

WORDS = ("x", "y", "z", "-x", "-y", "-z")
SLACK = 1.5  # axes that fit the case better than others by this factor are its axes


def direction(word: str) -> np.ndarray:
    """Unit vector (3,) of a word such as "-x"."""
    out = np.zeros(3)
    out["xyz".index(word[-1])] = -1.0 if word[0] == "-" else 1.0
    return out


def word_of(vector: np.ndarray) -> str:
    """The word of the axis that a vector is nearest to."""
    axis = int(np.argmax(np.abs(vector)))
    return ("-" if vector[axis] < 0.0 else "") + "xyz"[axis]


@dataclass(frozen=True)
class Axes:
    """`turn` (3, 3): rows are our axes in the file's; `origin` (3,) [m] is our origin in the
    file's axes.
    """

    turn: np.ndarray
    origin: np.ndarray

    @classmethod
    def of(cls, up: str, flow: str) -> "Axes":
        y, x = direction(up), direction(flow)
        if x @ y != 0.0:
            raise CaseError(f"--flow {flow}: along --up {up} (the flow is horizontal)")
        return cls(np.stack([x, y, np.cross(x, y)]), np.zeros(3))

    @property
    def words(self) -> tuple[str, str, str]:
        """The file's axes that are our x, y, z."""
        flow, up, across = (word_of(row) for row in self.turn)
        return flow, up, across

    def vectors(self, values: np.ndarray) -> np.ndarray:
        """(N, 3) or (3,) in our axes: velocities, forces, spins, branches."""
        return values @ self.turn.T

    def places(self, values: np.ndarray) -> np.ndarray:
        return self.vectors(values - self.origin)

    def box(self, box: Box) -> Box:
        """The corners and faces in our axes; a box that is tilted repeats only along those edges
        that are axes.
        """
        corners = self.places(np.stack([box.lower, box.upper]))
        periodic = np.array(box.periodic, bool)
        if box.tilt is not None:
            xy, xz, yz = box.tilt
            periodic &= [True, xy == 0.0, xz == 0.0 and yz == 0.0]
        which = np.argmax(np.abs(self.turn), axis=1)  # the file's axis of each of ours
        fixed = np.asarray(box.fixed, bool)[which]
        backward = self.turn.sum(axis=1) < 0.0
        fixed[backward] = fixed[backward, ::-1]
        return Box(corners.min(axis=0), corners.max(axis=0), periodic[which], fixed)


@dataclass(frozen=True)
class Seen:
    """What tells where up is, in the file's axes: of the grains that move the `extent` (3,) [m] at
    the first frame, and `moved` (3,) [m], how far their centre of mass goes to the last one (None
    for one frame), `grain` [m] their diameter; `below` (3,), whether the wall grains lie below
    along each axis; `periodic` (3,).
    """

    extent: np.ndarray
    moved: np.ndarray | None
    grain: float
    below: np.ndarray
    periodic: np.ndarray


def chosen(
    seen: Seen,
    up: str | None,
    flow: str | None,
    gravity: np.ndarray | None,
    size: np.ndarray | None,
    source: str,
    notes: list[str],
) -> Axes:
    """The axes that are asked for, else those that can be told. `gravity` (3,) in the file's axes;
    `size` (3,) [m] of the case's column along our axes. Raises CaseError, with what to give, where
    y was to be taken for up and is not.
    """
    if up is None:
        up = told_up(seen, gravity, size, source, notes)
    if flow is None:
        flow = fitting_flow(seen, up, size)
        if flow != "x":
            notes.append(f"assumed: {flow} is along the flow")
        if size is not None and seen.moved is not None:
            refuse_backwards(seen, flow, source)
    return Axes.of(up, flow)


def told_up(seen: Seen, gravity, size, source: str, notes: list[str]) -> str:
    """Raises CaseError where nothing tells it and y is implausible."""
    if gravity is not None and np.any(gravity):
        return word_of(-gravity)
    free = np.flatnonzero(~seen.periodic)
    if len(free) == 1:
        up = "xyz"[free[0]]
        if up != "y":
            notes.append(f"assumed: {up} is up (the only axis that is not periodic)")
        return up
    why, other = implausible(seen, size)
    if why:
        raise CaseError(f"{source}: y is not up ({why}) give --up {other}, or --up y if it is")
    notes.append("assumed: y is up")
    return "y"


def implausible(seen: Seen, size) -> tuple[str, str]:
    """Why y is not up, and what may be instead; two empty words where it may be y."""
    others = [word for word in ("z", "x") if not seen.periodic["xyz".index(word)]]
    hint = others[0] if others else "z"
    if others and seen.periodic[1]:
        return "the domain repeats along y", hint
    if not seen.below[1] and any(seen.below["xyz".index(word)] for word in others):
        under = next(word for word in others if seen.below["xyz".index(word)])
        return f"grains that never move lie below the others along {under}", under
    if size is not None:
        best = min(("y", *others), key=lambda up: misfit(seen, up, size))
        if best != "y" and misfit(seen, "y", size) > SLACK * misfit(seen, best, size):
            across = fitting_flow(seen, "y", size)
            extents = ", ".join(
                f"{1e3 * one:.3g}" for one in Axes.of("y", across).vectors(seen.extent)
            )
            return f"the column would be {extents} mm large, the case's is {_mm(size)}", best
    if seen.moved is not None and seen.moved[1] > 0.1 * seen.grain:
        falling = [word for word in others if seen.moved["xyz".index(word)] < -0.1 * seen.grain]
        return "the grains would gain potential energy", (falling or [hint])[0]
    return "", ""


def _mm(size: np.ndarray) -> str:
    return ", ".join(f"{1e3 * one:.3g}" for one in size)


def misfit(seen: Seen, up: str, size: np.ndarray, flow: str | None = None) -> float:
    """The largest factor between an extent of the grains and the case's."""
    turn = Axes.of(up, flow or fitting_flow(seen, up, size)).turn
    ratio = np.abs(turn @ seen.extent) / size
    return float(np.exp(np.max(np.abs(np.log(ratio)))))


def fitting_flow(seen: Seen, up: str, size) -> str:
    """The first horizontal axis of x, y, z, unless it is periodic and the other is not, or the
    other fits the case and it does not.
    """
    first, second = (word for word in "xyz" if word != up[-1])
    along = [seen.periodic["xyz".index(word)] for word in (first, second)]
    if along[0] != along[1]:
        return second if along[0] else first
    if size is None:
        return first
    factors = [misfit(seen, up, size, word) for word in (first, second)]
    return second if factors[0] > SLACK * factors[1] else first


def refuse_backwards(seen: Seen, flow: str, source: str):
    """Raises CaseError where the grains run against the flow, by more than a grain on average."""
    assert seen.moved is not None
    way = float(direction(flow) @ seen.moved)
    if way < -seen.grain:
        back = flow[1:] if flow.startswith("-") else f"-{flow}"
        raise CaseError(
            f"{source}: the grains run along {back} (their centre of mass goes {-1e3 * way:.3g} "
            f"mm) give --flow {back}, or --flow {flow} if that is meant"
        )
