"""The energy balance of a run: what grains hold, what contacts dissipated, what is unaccounted.

Held energies are exact at any moment. Dissipation is sampled: the powers of all contacts, every few
steps, count for the interval that ends there. Sampled at every step, the work done on each contact
less the elastic energy it holds is taken instead, which is the dissipation exactly. The residual
between the energy lost and the dissipation is reported, never folded into either.

Each contact's dissipation also counts half for either of its grains; where one of the two is glued,
or a wall, all of it for the moving one. So it has a place, and its sum over the moving grains is
that of the contacts.
"""

from collections import defaultdict

import numpy as np

from .contacts import Snapshot
from .fluctuation import fluctuation_energy
from .lifetimes import Lifetimes
from .scene import TYPES

DOCS = {
    "time": ("s", "since the release"),
    "kinetic": ("J", "translational kinetic energy of the moving grains"),
    "rotational": ("J", "rotational kinetic energy"),
    "potential": ("J", "potential energy, zero at y = 0"),
    "elastic": ("J", "elastic energy of all contacts"),
    "elastic_normal": ("J", "of it: normal, grain-grain"),
    "elastic_tangential": ("J", "of it: tangential, grain-grain"),
    "elastic_wall": ("J", "of it: in contacts with walls"),
    "fluctuation": (
        "J",
        "of the kinetic energy: motion about the local affine velocity field, in cells of 3 d",
    ),
    "dissipated_normal": ("J", "by normal damping between grains"),
    "dissipated_tangential": ("J", "by friction and tangential damping between grains"),
    "dissipated_base": ("J", "of these two: in contacts with glued grains"),
    "dissipated_wall": ("J", "in contacts with walls"),
    "dissipated_short": (
        "J",
        "between grains, by contacts shorter than dem.lifetime_threshold binary contact times",
    ),
    "dissipated_enduring": ("J", "between grains, by the longer ones"),
    "dissipated": ("J", "sampled dissipation, all of it"),
    "unaccounted": ("J", "initial energy - held - dissipated"),
    "time_step": ("s", "of the integration"),
}


class Audit:
    """Collects rows of the energy history: `add` at every sample and `row` where one is due."""

    def __init__(self, interval: float, every_step: bool, lifetimes: Lifetimes, start: Snapshot):
        """interval: between samples [s], one time step if `every_step`; start: at the release."""
        self.interval, self.every_step, self.lifetimes = interval, every_step, lifetimes
        self.rows: dict[str, list[float]] = defaultdict(list)
        self.enduring: list[np.ndarray] = []
        self.intake = np.zeros(4)  # normal, tangential, base (of these two), wall [J]
        self.grain_intake = np.zeros(start.atoms["id"].max() + 1)  # by id [J]
        self.force_error = 0.0
        self.initial = self.held(start)
        pairs, wall = self.contact_held(start)
        self.initially_held = self.totals(start, pairs, wall)
        self.grains_held = self.by_grain(start, pairs, wall)
        self.lifetimes.begin(*self.ids(start), pairs)
        self.row(start, 0.0)

    @staticmethod
    def ids(shot: Snapshot) -> tuple[np.ndarray, np.ndarray]:
        return shot.rows[:, 0].astype(np.int64), shot.rows[:, 1].astype(np.int64)

    @staticmethod
    def totals(shot: Snapshot, pairs: np.ndarray, wall: np.ndarray) -> np.ndarray:
        """Normal, tangential, base and wall sum of values per contact: pairs (n, 2), wall (m,)."""
        glued = shot.atoms["type"] == TYPES["glued"]
        return np.array(
            [*pairs.sum(axis=0), pairs[glued[shot.i] | glued[shot.j]].sum(), wall.sum()]
        )

    def by_grain(self, shot: Snapshot, pairs: np.ndarray, wall: np.ndarray) -> np.ndarray:
        """Values per contact, pairs (n, 2) and wall (m,), shared among grains (last id + 1,)."""
        value, ids = pairs.sum(axis=1), shot.atoms["id"]
        moves = shot.mobile[shot.i].astype(float), shot.mobile[shot.j].astype(float)
        both = np.maximum(moves[0] + moves[1], 1.0)  # two glued grains: of no consequence
        out = np.bincount(ids[shot.wall.grain], wall, self.grain_intake.size)
        for grain, share in zip((shot.i, shot.j), moves):
            out += np.bincount(ids[grain], value * share / both, out.size)
        return out

    def contact_held(self, shot: Snapshot) -> tuple[np.ndarray, np.ndarray]:
        """Elastic energy to be taken off the intake: of pairs (n, 2), of walls (m,) [J]."""
        if self.every_step:
            return shot.elastic_parts, shot.wall.elastic
        return np.zeros((shot.i.size, 2)), np.zeros(shot.wall.grain.size)

    def add(self, shot: Snapshot) -> None:
        """One sample."""
        pairs, wall = (
            (shot.work_rate_parts, shot.wall.work_rate)
            if self.every_step
            else (shot.power_parts, shot.wall.power)
        )
        self.intake += self.totals(shot, pairs, wall) * self.interval
        self.grain_intake += self.by_grain(shot, pairs, wall) * self.interval
        self.lifetimes.add(*self.ids(shot), pairs * self.interval, self.contact_held(shot)[0])
        self.force_error = max(self.force_error, shot.force_error)

    def dissipated(self, shot: Snapshot) -> np.ndarray:
        """Dissipated since the release by the contacts of each grain, in the order of shot.atoms
        (n,) [J].
        """
        by_id = self.grain_intake - self.by_grain(shot, *self.contact_held(shot)) + self.grains_held
        return by_id[shot.atoms["id"]]

    @staticmethod
    def held(shot: Snapshot) -> float:
        return shot.kinetic + shot.rotational + shot.potential + shot.elastic

    def row(self, shot: Snapshot, time: float) -> None:
        """One line of the history."""
        enduring = self.lifetimes.enduring()
        normal, tangential, base, wall = (
            self.intake - self.totals(shot, *self.contact_held(shot)) + self.initially_held
        )
        dissipated = normal + tangential + wall
        values = {
            "time": time,
            "kinetic": shot.kinetic,
            "rotational": shot.rotational,
            "potential": shot.potential,
            "elastic": shot.elastic,
            "elastic_normal": shot.elastic_normal.sum(),
            "elastic_tangential": shot.elastic_tangential.sum(),
            "elastic_wall": shot.wall.elastic.sum(),
            "fluctuation": fluctuation_energy(shot),
            "dissipated_normal": normal,
            "dissipated_tangential": tangential,
            "dissipated_base": base,
            "dissipated_wall": wall,
            "dissipated_short": normal + tangential - enduring[1],
            "dissipated_enduring": enduring[1],
            "dissipated": dissipated,
            "unaccounted": self.initial - self.held(shot) - dissipated,
            "time_step": shot.dt,
        }
        for name, value in values.items():
            self.rows[name].append(float(value))
        self.enduring.append(enduring)


def without_split(rows: dict) -> dict:
    """History of a run whose contacts were not sampled.

    All that was lost counts as dissipated, nothing is known apart.
    """
    kept = {
        name: np.asarray(values)
        for name, values in rows.items()
        if not name.startswith(("dissipated", "unaccounted"))
    }
    held = kept["kinetic"] + kept["rotational"] + kept["potential"] + kept["elastic"]
    return kept | {"dissipated": held[0] - held, "unaccounted": np.full(held.size, np.nan)}
