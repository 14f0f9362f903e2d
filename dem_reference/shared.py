"""A collapse whose grains are shared among ranks: every rank steps, looks at and audits its own,
and the first one adds up and writes. What crosses borders is told in border.py.

The sums run in another order than those of one rank, so trajectories differ by round-off, which
collisions multiply. Samples, rows and frames fall on the same steps.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cases.errors import CaseError

from . import scene
from .border import Border, SharedLiggghts
from .checkpoint import Keeper, Unfinished
from .collapse import Collapse, Column, audit_of
from .contacts import Snapshot
from .grains import Grains
from .moment import Accounts, Atoms, Held, Lifetimes, Moment, Sums, atoms_of, planes_of
from .process import Voice
from .restart import State
from .scene import TYPES
from .world import World

# What ranks cost beyond their own grains, as measured on columns of 3400 and 31000 grains
# (cases/column_small/reference/ranks.csv): so many diameters of the neighbour's on each side of a
# slab, whose contacts both ranks evaluate, and where a cut along x follows the flow what lies
# wrong in between.
OVERLAP, FOLLOWED = 0.4, 1.05
# Of the moving grains of a column those on the left of the cut, which have more neighbours: with so
# many its two sides take alike. How far from that they may be before the cut is moved.
LEFT, UNEVEN = 0.45, 0.02
BINS = 1024  # along x, in which the middle grain is looked for


@dataclass(frozen=True)
class Grid:
    """How ranks share the box: along x and along z."""

    x: int
    z: int

    def words(self) -> str:
        """As scene.beginning takes it."""
        return f"{self.x} 1 {self.z}"


def grid_of(case: dict, grains: Grains, ranks: int) -> Grid:
    """The cheapest of all grids.

    LIGGGHTS cuts its box into equal lengths, and only a chute's grains are spread evenly along x.
    So a column is cut along x once at most, in its middle (SharedColumn.rebalance), and along z,
    where it is even, except a quarter of a cylinder.
    """
    geometry, d = case["geometry"], grains.diameter
    along, across = geometry["length"], scene.width(case)
    most = ranks if scene.chute(case) else 2
    radial = scene.axisymmetric(case)

    def cost(grid: Grid) -> float:
        sides, late = (2, 1.0) if scene.chute(case) else (1, FOLLOWED)
        x = late * (1 + sides * OVERLAP * d * grid.x / along) if grid.x > 1 else 1.0
        z = 1 + 2 * OVERLAP * d * grid.z / across if grid.z > 1 else 1.0
        return x * z * (grid.z if radial else 1)

    grids = [Grid(x, ranks // x) for x in range(1, min(most, ranks) + 1) if ranks % x == 0]
    return min(grids, key=cost)


class SharedMoment(Moment):
    """Contacts of this rank's grains; what is told of all grains takes all ranks to ask."""

    def __init__(self, border: Border, *scene, **periods):
        self.border, self.world = border, border.world
        super().__init__(*scene, **periods)

    @property
    def held(self) -> Held:
        own = [getattr(self._view.held, name) for name, _ in Held._fields_]
        return Held(*self.world.sum(own[:-2]), *self.world.most(own[-2:]))

    @property
    def everyone(self) -> Atoms:
        """All grains, for the first rank, without what acts on them; none elsewhere."""
        engine, gather = self.border.engine, self.world.gather
        x, v = gather(engine.vectors("x")), gather(engine.vectors("v"))
        kept = [x, v, *(gather(engine.integers(name)) for name in ("id", "type"))]
        kept += [gather(engine.scalars("radius"))] if engine.sized else []
        self._everyone = kept  # as long as its addresses are used
        place = [values.ctypes.data for values in kept]
        radius = place[4] if engine.sized else None
        return Atoms(len(x), len(x), *place[:2], None, None, None, *place[2:4], radius)


class SharedAccounts(Accounts):
    """Accounts of the contacts that count on this rank; sums take all ranks to ask."""

    def __init__(self, start: SharedMoment, *about):
        super().__init__(start, *about)
        self.border, self.world = start.border, start.world
        self._version = self.border.version

    def add(self, moment: Moment) -> None:
        if self._version != self.border.version:
            self.hand_over()
            self._version = self.border.version
        super().add(moment)

    def hand_over(self) -> None:
        """What is carried of contacts goes to the rank that owns the grain of the lower id now."""
        gone = self.leave(self.border.owners, self.world.rank)
        to = self.border.owners[(gone["key"] >> 32).astype(np.int64)]
        order = np.argsort(to, kind="stable")
        self.join(self.world.swap(gone[order], *self.world.counts(to)))

    def row(self, moment: Moment) -> tuple[Sums, np.ndarray, tuple[float, float]]:
        gone, enduring, errors = super().row(moment)
        sums = self.world.sum([*gone, *enduring])
        worst = self.world.most(errors)
        return Sums(*sums[: len(gone)]), sums[len(gone) :], (float(worst[0]), float(worst[1]))

    def by_grain(self, moment: Moment) -> np.ndarray:
        """Of all grains in the order of SharedColumn.snapshot, for the first rank."""
        sums = self.world.first_sum(self.by_id(moment, self.border.owners.size))
        return sums[self.world.gather(self.border.engine.integers("id"))]

    def lifetimes(self) -> Lifetimes:
        own = super().lifetimes()
        heat = self.world.sum(own.heat.ravel()).reshape(own.heat.shape)
        contacts = np.rint(self.world.sum(own.contacts)).astype(np.int64)
        return own._replace(heat=heat, contacts=contacts)


class SharedColumn(Column):
    """The grains of all ranks while they collapse."""

    engine: SharedLiggghts

    def __init__(self, case: dict, packing: Path, log: Path, world: World):
        self.world = world
        self.grid = grid_of(case, Grains.of(case), world.size)
        super().__init__(case, packing, log)

    def looked_at(self, log: Path) -> tuple[SharedLiggghts, Moment]:
        engine = SharedLiggghts(log, self.grains, self.world)
        self.border = Border(engine)
        about = self.grains, self.plan.dt, self.weight
        return engine, SharedMoment(self.border, *about, pull=self.pull, **self.periods)

    def release(self, packing: Path, work: Path | None, ranks: str = "") -> None:
        """As of a column alone; files are read by the first rank, so it alone puts them there."""
        super().release(packing, work if self.world.first else None, self.grid.words())
        self.rebalance()
        touching = self.engine.touches_at_all()
        if self.world.most([not touching])[0]:
            raise CaseError(
                f"--ranks {self.world.size}: too many (one would hold no grains that touch) take "
                "fewer"
            )

    def look(self, now: float) -> Moment:
        self._atoms, own, self._rows = self.border.look()  # as long as they are looked at
        self.moment.look(
            atoms_of(self._atoms, own),
            self._rows.ctypes.data,
            len(self._rows),
            planes_of(self.standing(now)),
        )
        return self.moment

    def snapshot(self, now: float) -> Snapshot | None:
        """All grains and contacts, for the first rank."""
        atoms = {name: self.world.gather(own) for name, own in self.engine.atoms().items()}
        rows = self.world.gather(self.engine.contacts())
        return self.shot(atoms, rows, now) if self.world.first else None

    def kinetic_on_floor(self) -> float:
        return float(self.world.sum([super().kinetic_on_floor()])[0])

    def is_uneven(self) -> bool:
        """Whether a side of the cut along x holds more of the moving grains than it should."""
        if self.grid.x != 2 or scene.chute(self.case):
            return False
        x, at = self.moving(), sum(self.ends()) / 2
        left, right = self.world.sum([np.count_nonzero(x < at), np.count_nonzero(x >= at)])
        return bool(abs(left / (left + right) - LEFT) > UNEVEN)

    def rebalance(self) -> None:
        """Moves the one cut along x to where the grains are halved, where that has moved away."""
        if self.is_uneven():
            edges = np.linspace(*self.ends(), BINS + 1)
            count = np.cumsum(self.world.sum(np.histogram(self.moving(), edges)[0]))
            self.cut(float(edges[np.searchsorted(count, LEFT * count[-1]) + 1]))

    def moving(self) -> np.ndarray:
        """x of this rank's moving grains (n,) [m]."""
        return self.engine.vectors("x")[self.engine.integers("type") == TYPES["grain"], 0]

    def ends(self) -> tuple[float, float]:
        """Of the box along x [m]."""
        return self.engine.extent("boxxlo"), self.engine.extent("boxxhi")

    def cut(self, middle: float) -> None:
        """Moves the one cut along x to `middle` [m]: the box, which is cut in its middle, grows
        beyond its wall or its floor's end by as much as it takes.

        Grains move to other ranks by that, and their springs with them only where a restart has
        just been written, which takes them out of the lists of neighbours. A set-up evaluates
        forces with other velocities than the step did, so these are put back, as in restart.py.
        """
        engine = self.engine
        x = engine.vectors("x")[:, 0]
        beyond = self.world.most([x.max(initial=self.bounds[1])])[0]
        low, high = self.bounds[0], float(beyond)
        half = max(middle - low, high - middle)
        ids, own = engine.integers("id"), ("f", "torque")
        told = np.hstack([ids[:, None], *(engine.vectors(name) for name in own)])
        all_of_them, _ = self.world.everywhere(told)
        box = f"{middle - half:.17g} {middle + half:.17g}"
        engine.commands(f"write_restart /dev/null\nchange_box all x final {box} units box\nrun 0")
        acting = np.empty((int(all_of_them[:, 0].max()) + 1, 6))
        acting[all_of_them[:, 0].astype(np.int64)] = all_of_them[:, 1:]
        ids = engine.integers("id")
        for k, name in enumerate(own):
            engine.vectors(name)[:] = acting[ids, 3 * k : 3 * k + 3]


class SharedCollapse(Collapse):
    """A collapse on all ranks, whose result the first one writes."""

    column: SharedColumn

    def __init__(self, world: World, *about):
        self.world, self.uneven = world, False
        super().__init__(*about)

    def column_of(self, log: Path, kept: State | None) -> SharedColumn:
        return SharedColumn(self.case, self.packing, log, self.world)

    def audit_of(self, column: Column):
        return audit_of(self.case, column, SharedAccounts)

    def open(self) -> None:
        if self.world.first:
            super().open()

    def sample(self) -> bool:
        rests = super().sample()
        if self.step % self.plan.row == 0:
            self.uneven = self.column.is_uneven()
        return rests

    def advance(self) -> None:
        """A cut is moved in a step that lists neighbours, the next one: in any other, one listing
        more would change what the engine does. A contact that has opened keeps its spring until the
        next listing, and takes it up again if it closes before.
        """
        engine, end = self.column.engine, self.step + self.plan.sample
        with self.spent.on("engine"):
            if self.uneven:
                engine.reach(min(end, max(engine.step(), self.column.border.next_listing())))
            while self.uneven and engine.step() < end:
                engine.advance(1)  # twice the work: a piece of a run begins with the forces
                if engine.has_listed():
                    self.column.rebalance()
                    self.uneven = False
        super().advance()

    def complete(self, shot: Snapshot | None, reason: str) -> None:
        """The processor time is that of all ranks, waiting for each other included."""
        parts = self.spent.seconds
        self.spent.seconds = dict(zip(parts, self.world.sum(list(parts.values()))))
        if self.world.first:
            super().complete(shot, reason)
        elif self.sampled:  # what the first one asks for
            self.audit.accounts.finish()
            self.audit.accounts.lifetimes()
        if not self.world.first:
            self.taken()

    def taken(self) -> np.ndarray:
        """All ranks' processor time, and this one's time of the clock (2,) [s]."""
        cpu, wall = super().taken()
        return np.array([self.world.sum([cpu])[0], wall])


def collapse(
    world: World,
    case: dict,
    packing: Path,
    log: Path,
    target: Path,
    attributes: dict,
    unfinished: Unfinished,
    report: Voice,
) -> None:
    """As collapse.collapse, on every rank; nothing of it is kept half-way."""
    keeper = Keeper(unfinished, 0, report)
    SharedCollapse(world, case, packing, log, target, attributes, keeper, None).go(report)
