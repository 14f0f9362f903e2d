"""The energy history that places and velocities tell.

Held are kinetic, rotational and potential energy of the grains that move. What vanishes with a
grain is an account of its own, `lost`; what has gone otherwise is booked as dissipated, elastic
energy included.
"""

from dataclasses import dataclass, field

import numpy as np

DOCS = {
    "time": "of the frames",
    "kinetic": "of the grains' translation",
    "rotational": "of the grains' spins",
    "potential": "minus sum of m g x, zero at the origin",
    "lost": "of grains that vanished, as they had it last, less what grains that came had first",
    "lost_potential": "what of lost is potential energy",
    "dissipated": "what was there at first, is held no more and did not vanish with grains",
    "unaccounted": "none: what is not told otherwise counts as dissipated",
}


@dataclass
class Ledger:
    """`gravity` (3,) [m/s2] in the axes of the places that it is told."""

    gravity: np.ndarray
    rows: dict[str, list[float]] = field(default_factory=lambda: {name: [] for name in DOCS})
    # ids, energies and potential energies of the last frame
    before: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
    gone: float = 0.0
    gone_potential: float = 0.0
    vanished: int = 0
    came: int = 0

    def add(
        self,
        time: float,
        ids: np.ndarray,
        mass: np.ndarray,
        radius: np.ndarray,
        place: np.ndarray,
        velocity: np.ndarray,
        spin: np.ndarray | None,
    ):
        """The grains that move at one instant: scalars (N,), vectors (N, 3), ids in order."""
        kinetic = 0.5 * mass * np.sum(velocity**2, axis=1)
        rotational = np.zeros_like(mass)
        if spin is not None:
            rotational = (
                0.2 * mass * radius**2 * np.sum(spin**2, axis=1)
            )  # 2/5 m r2 of a sphere
        potential = -mass * (place @ self.gravity)
        each = kinetic + rotational + potential
        if self.before is not None and not np.array_equal(self.before[0], ids):
            old_ids, old, old_potential = self.before
            left = ~np.isin(old_ids, ids, assume_unique=True)
            new = ~np.isin(ids, old_ids, assume_unique=True)
            self.gone += float(old[left].sum() - each[new].sum())
            self.gone_potential += float(old_potential[left].sum() - potential[new].sum())
            self.vanished += int(left.sum())
            self.came += int(new.sum())
        self.before = ids, each, potential
        for name, value in (
            ("time", time),
            ("kinetic", kinetic.sum()),
            ("rotational", rotational.sum()),
            ("potential", potential.sum()),
            ("lost", self.gone),
            ("lost_potential", self.gone_potential),
        ):
            self.rows[name].append(float(value))

    def history(self) -> dict[str, np.ndarray]:
        """All of DOCS, each (frames,): time [s], else [J]."""
        rows = {name: np.array(values) for name, values in self.rows.items() if values}
        total = rows["kinetic"] + rows["rotational"] + rows["potential"]
        rows["dissipated"] = total[0] - total - rows["lost"]
        rows["unaccounted"] = np.zeros_like(total)
        return rows
