"""What a reader takes from a file of another program: frames, in the file's own units and axes."""

from dataclasses import dataclass, field

import numpy as np

# Columns by the names that readers give them; a file may hold few of these, and others besides.
VECTORS = {
    "position": ("x", "y", "z"),
    "velocity": ("vx", "vy", "vz"),
    "spin": ("omegax", "omegay", "omegaz"),
    "stress": ("sxx", "syy", "szz", "sxy", "syz", "szx"),
}
SCALARS = ("id", "type", "radius", "mass", "density", "volume", "void_ratio", "temperature")
# Contacts: the force on the first of two grains; where known, the contact point, the branch from
# the second centre to the first, and the power dissipated. A second that is not positive is a wall.
CONTACTS = ("first", "second", "fx", "fy", "fz", "px", "py", "pz", "bx", "by", "bz", "power")


@dataclass(frozen=True)
class Box:
    """Corners of the domain (3,), whether it repeats along each axis, and whether its faces are
    fixed walls of the domain, (3, 2), rather than follow the grains. A triclinic box has the `tilt`
    factors xy, xz, yz.
    """

    lower: np.ndarray
    upper: np.ndarray
    periodic: np.ndarray
    fixed: np.ndarray
    tilt: np.ndarray | None = None


@dataclass
class Frame:
    """One instant. `columns` by name, each (N,); `contacts` by name of CONTACTS, each (C,), or None
    where the file has none. `source` says where the frame stands: a file, and the line if it has
    lines. `compression`: whether pressure is positive in the stress. What a file does not tell is
    None.
    """

    source: str
    columns: dict[str, np.ndarray] = field(default_factory=dict)
    step: int | None = None
    time: float | None = None
    box: Box | None = None
    units: str | None = None
    contacts: dict[str, np.ndarray] | None = None
    compression: bool | None = None


def note(options: dict, text: str) -> None:
    """Tells the pipeline what a reader assumed or dropped, once; nobody if `notes` is None."""
    notes = options.setdefault("notes", [])
    if notes is not None and text not in notes:
        notes.append(text)
