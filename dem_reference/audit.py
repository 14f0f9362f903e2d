"""The energy balance of a run: what grains hold, what contacts dissipated, what is unaccounted.

Held energies are exact at any moment, dissipation is sampled (ledger/accounts.hpp). The residual
between the energy lost and the dissipation is reported, never folded into either.
"""

from collections import defaultdict

import numpy as np

from .drive import Drive
from .moment import Accounts, Moment, fluctuation_energy

DOCS = {
    "time": ("s", "since the release"),
    "kinetic": ("J", "translational kinetic energy of the moving grains"),
    "rotational": ("J", "rotational kinetic energy"),
    "potential": ("J", "potential energy, zero at y = 0"),
    "elastic": ("J", "elastic energy of all contacts"),
    "elastic_normal": ("J", "of it: normal, grain-grain"),
    "elastic_tangential": ("J", "of it: tangential, grain-grain"),
    "elastic_rolling": ("J", "of it: rolling resistance, grain-grain"),
    "elastic_wall": ("J", "of it: in contacts with walls"),
    "fluctuation": (
        "J",
        "of the kinetic energy: motion about the local affine velocity field, in cells of 3 d",
    ),
    "dissipated_normal": ("J", "by normal damping between grains"),
    "dissipated_tangential": ("J", "by friction and tangential damping between grains"),
    "dissipated_rolling": ("J", "by rolling resistance between grains"),
    "dissipated_base": ("J", "of these: in contacts with glued grains"),
    "dissipated_wall": ("J", "in contacts with walls"),
    "gate_work": ("J", "done on the grains by the gate that rises"),
    "dissipated_short": (
        "J",
        "between grains, by contacts shorter than dem.lifetime_threshold binary contact times",
    ),
    "dissipated_enduring": ("J", "between grains, by the longer ones"),
    "dissipated": ("J", "sampled dissipation, all of it"),
    "driven": ("J", "work of gravity along the slope of a chute since the release"),
    "unaccounted": ("J", "initial energy + driven + work of the gate - held - dissipated"),
    "time_step": ("s", "of the integration"),
}


class Audit:
    """Collects rows of the energy history: `add` at every sample and `row` where one is due."""

    def __init__(
        self,
        interval: float,
        every_step: bool,
        unit: float,
        threshold: float,
        start: Moment,
        radial: bool,
        lifted: bool = False,
        drive: Drive | None = None,
        accounts: type[Accounts] = Accounts,
    ):
        """interval: between samples [s], one time step if `every_step`; unit: binary contact time
        [s]; threshold: of an enduring contact, in units; start: at the release; radial: whether
        means depend on the distance from the y axis, not on x; lifted: whether a gate rises; drive:
        of a chute; accounts: who keeps them.
        """
        self.interval, self.unit, self.radial = interval, unit, radial
        self.accounts = accounts(start, interval, every_step, unit, threshold)
        self.absent = () if start.grains.rolls else ("elastic_rolling", "dissipated_rolling")
        self.absent += () if lifted else ("gate_work",)
        self.rows: dict[str, list[float]] = defaultdict(list)
        self.enduring: list[np.ndarray] = []
        self.errors: tuple[float, float] = (0.0, 0.0)  # of forces [N] and torques [N m]
        self.drive = drive
        self.initial, self.dt = start.held.total, start.dt
        self.row(start, 0.0)

    def state(self) -> dict[str, np.ndarray]:
        """All that samples and rows have changed since the release."""
        return {
            "accounts": self.accounts.state(),
            "rows": np.array(list(self.rows.values())),
            "enduring": np.array(self.enduring),
            "errors": np.array(self.errors),
            "initial": np.array(self.initial),
        } | (self.drive.state() if self.drive else {})

    def take_up(self, kept: dict[str, np.ndarray]) -> None:
        """Goes on with what `state` has told of another audit of the same run."""
        self.accounts.take_up(kept["accounts"])
        self.rows = defaultdict(list, zip(self.rows, kept["rows"].tolist()))
        self.enduring = list(kept["enduring"])
        self.initial = float(kept["initial"])
        self.errors = (float(kept["errors"][0]), float(kept["errors"][1]))
        if self.drive:
            self.drive.take_up(kept)

    def row(self, moment: Moment, time: float) -> None:
        """One line of the history."""
        gone, enduring, self.errors = self.accounts.row(moment)
        held, pairs = moment.held, gone.pairs
        driven = {"driven": self.drive.look(moment.everyone)} if self.drive else {}
        given = self.initial + driven.get("driven", 0.0) + gone.driven
        values = {
            "time": time,
            "kinetic": held.kinetic,
            "rotational": held.rotational,
            "potential": held.potential,
            "elastic": held.elastic,
            "elastic_normal": held.normal,
            "elastic_tangential": held.tangential,
            "elastic_rolling": held.rolling,
            "elastic_wall": held.wall,
            "fluctuation": fluctuation_energy(moment.everyone, moment.grains, self.radial),
            "dissipated_normal": gone.normal,
            "dissipated_tangential": gone.tangential,
            "dissipated_rolling": gone.rolling,
            "dissipated_base": gone.base,
            "dissipated_wall": gone.wall,
            "gate_work": gone.driven,
            "dissipated_short": pairs - enduring[1],
            "dissipated_enduring": enduring[1],
            "dissipated": pairs + gone.wall,
            "unaccounted": given - held.total - (pairs + gone.wall),
            "time_step": self.dt,
        } | driven
        for name, value in values.items():
            if name not in self.absent:
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
    driven = kept.get("driven", 0.0)
    return kept | {"dissipated": held[0] + driven - held, "unaccounted": np.full(held.size, np.nan)}
