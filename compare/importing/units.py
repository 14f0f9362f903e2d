"""Units of other programs' files, turned into SI.

A unit system is told by its units of length, mass and time; all else derives from these three. The
names are LAMMPS', and LIGGGHTS has the same. Systems whose units of force do not derive so
(electron, real, metal) are those of atoms, and no grains'.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from cases.errors import CaseError
from compare.importing.frame import Box

# Powers of length, mass and time of a column or of what a contact has.
POWERS = (
    {name: (1, 0, 0) for name in ("x", "y", "z", "radius", "px", "py", "pz", "bx", "by", "bz")}
    | {name: (1, 0, -1) for name in ("vx", "vy", "vz")}
    | {name: (0, 0, -1) for name in ("omegax", "omegay", "omegaz")}
    | {name: (-1, 1, -2) for name in ("sxx", "syy", "szz", "sxy", "syz", "szx")}
    | {name: (1, 1, -2) for name in ("fx", "fy", "fz")}
    | {
        "mass": (0, 1, 0),
        "density": (-3, 1, 0),
        "volume": (3, 0, 0),
        "temperature": (2, 0, -2),
        "power": (2, 1, -3),
    }
)
OF_ATOMS = ("electron", "real", "metal")


@dataclass(frozen=True)
class Units:
    """One unit of a system in SI: length [m], mass [kg], time [s]."""

    name: str
    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    def factor(self, name: str) -> float:
        """What a column's values are multiplied by; 1 for what has no unit."""
        powers = POWERS.get(name, (0, 0, 0))
        return self.length ** powers[0] * self.mass ** powers[1] * self.time ** powers[2]

    def columns(self, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Columns in SI; those that need no factor are the same arrays."""
        factors = {name: self.factor(name) for name in columns}
        return {k: v if factors[k] == 1.0 else factors[k] * v for k, v in columns.items()}

    def box(self, box: Box | None) -> Box | None:
        if box is None or self.length == 1.0:
            return box
        tilt = None if box.tilt is None else self.length * box.tilt
        return Box(self.length * box.lower, self.length * box.upper, box.periodic, box.fixed, tilt)


SYSTEMS = {
    one.name: one
    for one in (
        Units("si"),
        Units("cgs", 1e-2, 1e-3),
        Units("micro", 1e-6, 1e-15, 1e-6),  # micrometre, picogram, microsecond
        Units("nano", 1e-9, 1e-21, 1e-9),  # nanometre, attogram, nanosecond
    )
}


def chosen(
    told: Iterable[tuple[str, str | None]],
    asked: str | None,
    scales: tuple[float | None, float | None, float | None],
    notes: list[str],
) -> Units:
    """The units of all frames. `told`: source and word of each; `asked`: the user's word; `scales`:
    length [m], mass [kg] and time [s] of the system lj. Raises CaseError for words that are not
    known or do not agree.
    """
    named = {word.lower(): source for source, word in reversed(list(told)) if word}
    if len(named) > 1:
        words = ", ".join(f"{word} in {source}" for word, source in sorted(named.items()))
        raise CaseError(f"units: several at once ({words}) import them one by one")
    word, source = next(iter(named.items()), (None, ""))
    where = f"{source}: UNITS" if word else "--units"
    if word and asked and word != asked:
        raise CaseError(f"{where} is {word} (--units says {asked}) leave --units out")
    if not word and not asked:
        notes.append("assumed: lengths, masses and times are SI (the file names no units)")
    name = word or asked or "si"
    if name == "lj":
        length, mass, time = scales
        if length is None or mass is None or time is None:
            raise CaseError(
                f"{where} is lj (without dimensions) give --lj-length, --lj-mass and --lj-time"
            )
        return Units("lj", length, mass, time)
    if any(scale is not None for scale in scales):
        raise CaseError(f"--lj-length, --lj-mass, --lj-time: of units lj only (these are {name})")
    if name in OF_ATOMS:
        raise CaseError(f"{where} is {name} (units of atoms, in which no grains are computed)")
    if name not in SYSTEMS:
        raise CaseError(f"{where} is '{name}' (known are {', '.join(SYSTEMS)}, lj) see --units")
    if name != "si":
        notes.append(f"turned: from units {name} into SI")
    return SYSTEMS[name]
