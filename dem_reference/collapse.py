"""The collapse of a settled packing, audited while it runs."""

import time
from pathlib import Path

import numpy as np

from cases import openpmd
from cases.errors import EngineError, Failure
from cases.scenes import gravity_of

from . import plates, restart, scene
from .audit import Audit, without_split
from .checkpoint import Keeper, Unfinished
from .contacts import Snapshot
from .drive import drive_of
from .engine import Liggghts
from .grains import Grains
from .moment import Accounts, Moment, planes_of
from .output import Result
from .plan import Plan
from .process import Voice
from .release import acting, released, settled
from .restart import State
from .spent import Spent, processor_seconds


class Column:
    """The grains while they collapse: the engine, and what is looked at of it."""

    def __init__(self, case: dict, packing: Path, log: Path, kept: State | None = None):
        """From the settled `packing`, a folder, to the instant of release, or to a state that was
        `kept`.
        """
        self.case, self.grains, self.plan = case, Grains.of(case), Plan.of(case)
        geometry, walls = case["geometry"], case["walls"]
        self.pull, self.weight = gravity_of(geometry)
        self.periods = scene.periods(case)
        self.engine, self.moment = self.looked_at(log)
        self.lifted = walls["gate"] == "lifted" if kept is None else bool(kept["lifted"])
        if kept is None:
            self.release(packing, log.parent)
        else:
            self.bounds = kept["bounds"]
            self.resume(kept, log.parent)
        self.count, self.walls = self.engine.count(), plates.standing(case, self.grains)
        beyond = geometry["height"] + self.grains.largest
        speed = walls["gate_speed"]
        self.gate_gone = beyond / speed if walls["gate"] == "lifted" else 0.0  # [s]

    def looked_at(self, log: Path) -> tuple[Liggghts, Moment]:
        """The engine, and what looks at it."""
        moment = Moment(self.grains, self.plan.dt, self.weight, pull=self.pull, **self.periods)
        return Liggghts(log, self.grains), moment

    def release(self, packing: Path, work: Path | None, ranks: str = "") -> None:
        """From the settled packing; `work` and `ranks`: as of `settled`."""
        self.engine.commands(settled(self.case, self.grains, packing, work, ranks))
        self.bounds = self.engine.bounds()
        act = acting(self.case, self.grains, self.plan, work, self.lifted)
        self.engine.commands(f"{act}\n{released(self.case)}")

    def resume(self, kept: State, work: Path) -> None:
        """To a state that was kept."""
        case, grains = self.case, self.grains
        with restart.in_memory(kept["restart"].tobytes()) as path:
            begin = scene.beginning(case, grains, f"read_restart {path}", grains.young_modulus)
            self.engine.commands(begin)
        self.engine.commands(acting(case, grains, self.plan, work, self.lifted))
        restart.resume(self.engine, self.bounds, kept)

    def state(self) -> State:
        """What `resume` takes."""
        kept = {"lifted": np.array(self.lifted), "bounds": self.bounds}
        return restart.state(self.engine) | kept

    def standing(self, now: float) -> list[scene.Plane]:
        """The walls that stand."""
        gate = [scene.rising_gate(self.case, now)] if now < self.gate_gone else []
        return self.walls + gate

    def look(self, now: float) -> Moment:
        """All grains and contacts, `now` [s] after the release; valid until the engine goes on."""
        rows, count = self.engine.held_contacts()
        self.moment.look(self.engine.held(), rows, count, planes_of(self.standing(now)))
        return self.moment

    def snapshot(self, now: float) -> Snapshot | None:
        """The same as a copy, for whoever writes it."""
        return self.shot(self.engine.atoms(), self.engine.contacts(), now)

    def shot(self, atoms: dict[str, np.ndarray], rows: np.ndarray, now: float) -> Snapshot:
        return Snapshot(
            self.grains,
            atoms,
            rows,
            self.plan.dt,
            self.weight,
            planes=self.standing(now),
            pull=self.pull,
            **self.periods,
        )

    def kinetic_on_floor(self) -> float:
        """Translational kinetic energy of the moving grains that are still on the floor [J]."""
        mobile = self.engine.integers("type") == scene.TYPES["grain"]
        mobile &= ~scene.beyond_floor(self.engine.vectors("x"), self.case)
        v = self.engine.vectors("v")[mobile]
        if self.grains.even:
            return self.grains.mass / 2 * float((v * v).sum())
        mass = self.engine.scalars("rmass")[mobile]
        return float(mass @ (v * v).sum(axis=1)) / 2

    def drop_gate(self, now: float) -> None:
        """Removes a gate that has been lifted beyond the column."""
        if self.lifted and now >= self.gate_gone:
            self.engine.commands(plates.REMOVE_LIFTED_GATE + "\nrun 0")
            self.lifted = False

    def refuse_losses(self, now: float) -> None:
        lost = self.count - self.engine.count()
        if lost:
            raise EngineError(
                f"LIGGGHTS: lost {lost} of {self.count} grains by t = {now:.4g} s",
                Failure.LOST_GRAINS,
            )


class Collapse:
    """A collapse on its way: the grains, their accounts, and the result so far.

    Ends at rest (kinetic energy on the floor below time.rest_kinetic_energy of its peak, past the
    peak) or at time.maximum. Grains that have rolled off the floor's end never stop, and the
    deposit does not wait for them.
    """

    def __init__(
        self,
        case: dict,
        packing: Path,
        log: Path,
        target: Path,
        attributes: dict,
        keeper: Keeper,
        kept: State | None,
    ):
        """From the settled `packing`, or from what is `kept`; writes `target`."""
        self.began, self.spent = time.monotonic(), Spent()
        self.case, self.packing, self.target = case, packing, target
        self.attributes, self.keeper = attributes, keeper
        self.column = self.column_of(log, kept)
        self.plan, self.sampled = self.column.plan, case["dem"]["audit_interval"] > 0
        self.spent.began()
        with self.spent.on("audit"):
            self.audit = self.audit_of(self.column)
        self.step, self.peak, self.earlier = 0, 0.0, np.zeros(2)  # step: of the last sample
        self.wanted: int | None = None  # step from which on a checkpoint is wanted
        self.frames = 0  # in this file
        with self.spent.on("output"):
            self.open()
        if kept is None:
            self.frame()
        else:
            self.take_up(kept)

    def column_of(self, log: Path, kept: State | None) -> Column:
        return Column(self.case, self.packing, log, kept)

    def audit_of(self, column: Column) -> Audit:
        return audit_of(self.case, column)

    def open(self) -> None:
        """A file of frames to write."""
        self.result = Result(self.target, self.attributes)

    @property
    def now(self) -> float:
        """Since the release [s]."""
        return self.step * self.plan.dt

    def go(self, report: Voice) -> None:
        """To the end, and the result complete."""
        plan, reason, shot = self.plan, "maximum", None
        while self.step < plan.last and reason != "rest":
            self.advance()
            with self.spent.on("audit"):
                if self.sample():
                    reason = "rest"
            if self.step % plan.row == 0:
                told = f"collapse t = {self.now / plan.scale:.2f} sqrt(H/g)"
                report(self.step / plan.last, told)
            if self.step % plan.frame == 0 or reason == "rest" or self.step >= plan.last:
                shot = self.frame()
            with self.spent.on("engine"):
                self.column.drop_gate(self.now)
        self.complete(shot, reason)

    def complete(self, shot: Snapshot | None, reason: str) -> None:
        """The result, of the last frame and why it is the last."""
        assert shot
        with self.spent.on("output"):
            self.keeper.merge(self.result.file)
            write_history(self.result, self.audit, self.sampled)
            errors = self.audit.errors
            finish(self.result, self.packing, self.case, shot, self.plan, reason, self.step, errors)
        cpu, wall = self.taken()
        close(self.result, cpu, wall, self.spent.attributes())

    def advance(self) -> None:
        """To the next sample. A checkpoint that is due is kept on the way, where one can be
        (restart.py): from then on step by step.
        """
        engine, end = self.column.engine, self.step + self.plan.sample
        at = engine.step()
        if self.wanted is None and self.keeper.due():
            self.wanted = restart.next_sort(at)
        if self.wanted is not None and at < end and end >= self.wanted:
            with self.spent.on("engine"):
                at = engine.reach(max(at, self.wanted - 1))
                listed = False
                while at < end and not listed:
                    at = engine.reach(at + 1)
                    listed = engine.has_listed()
            if listed:
                self.keep(at)
                self.wanted = None
        with self.spent.on("engine"):
            engine.reach(end)
        self.step = end

    def sample(self) -> bool:
        """Looks at all contacts; whether the grains have come to rest."""
        moment, audit = self.column.look(self.now), self.audit
        if self.sampled:
            audit.accounts.add(moment)
        if self.step % self.plan.row:
            return False
        self.column.refuse_losses(self.now)
        audit.row(moment, self.now)
        self.peak = max(self.peak, moment.held.kinetic)
        quiet = self.case["time"]["rest_kinetic_energy"] * self.peak
        return self.now > self.plan.scale and self.column.kinetic_on_floor() < quiet

    def frame(self) -> Snapshot | None:
        """Writes one; what it shows, to whoever is told it."""
        with self.spent.on("output"):
            shot = self.column.snapshot(self.now)
            gone = self.audit.accounts.by_grain(self.column.moment) if self.sampled else None
            if shot:
                self.result.frame(self.step, self.now, shot, self.case["output"]["contacts"], gone)
            self.frames += 1
        return shot

    def keep(self, step: int) -> None:
        """A checkpoint at `step`, between two samples."""
        with self.spent.on("output"):
            if self.frames:
                self.result.file.close()
                self.keeper.take_frames(self.target)
                self.result, self.frames = Result(self.target, self.attributes), 0
            state = self.column.state() | self.audit.state()
            self.keeper.keep(step, state | self.own_state(step))

    def own_state(self, step: int) -> State:
        told = {
            "time": step * self.plan.dt,
            "sampled": self.step,
            "peak": self.peak,
            "spent": list(self.spent.seconds.values()),
            "taken": self.taken(),
        }
        return {name: np.array(value) for name, value in told.items()}

    def take_up(self, kept: State) -> None:
        self.step, self.peak = int(kept["sampled"]), float(kept["peak"])
        self.audit.take_up(kept)
        self.spent.add(kept["spent"])
        self.earlier = kept["taken"]

    def taken(self) -> np.ndarray:
        """Processor time and time of the clock (2,) [s], those of earlier parts of the run, up to
        their checkpoint, with them.
        """
        return self.earlier + (processor_seconds(), time.monotonic() - self.began)


def collapse(
    case: dict,
    packing: Path,
    log: Path,
    target: Path,
    attributes: dict,
    unfinished: Unfinished,
    kept: State | None,
    report: Voice,
) -> None:
    """Runs the collapse in this process, from the settled `packing` or on from what is `kept`, and
    writes `target`.
    """
    keeper = Keeper(unfinished, int(kept["segments"]) if kept else 0, report)
    Collapse(case, packing, log, target, attributes, keeper, kept).go(report)


def audit_of(case: dict, column: Column, accounts: type[Accounts] = Accounts) -> Audit:
    """The accounts of a collapse, at its release."""
    plan, gravity = column.plan, case["geometry"]["gravity"]
    return Audit(
        plan.sample * plan.dt,
        plan.sample == 1,
        column.grains.binary_contact_time(gravity),
        case["dem"]["lifetime_threshold"],
        column.look(0.0),
        scene.axisymmetric(case),
        case["walls"]["gate"] == "lifted",
        drive_of(case, column.grains),
        accounts,
    )


def write_history(result: Result, audit: Audit, sampled: bool) -> None:
    if not sampled:
        result.history(without_split(audit.rows))
        return
    audit.accounts.finish()
    result.history(audit.rows)
    result.lifetimes(audit)


def finish(
    result: Result,
    packing: Path,
    case: dict,
    shot: Snapshot,
    plan: Plan,
    reason: str,
    step: int,
    errors: tuple[float, float],
) -> None:
    """Puts into a result its packing and what is known only at the end."""
    result.packing(packing / "packing.h5")
    beyond = scene.beyond_floor(shot.atoms["x"][shot.mobile], case)
    openpmd.describe(
        result.file,
        end_reason=reason,
        steps=step,
        time_scale=plan.scale,
        grains_beyond_floor=int(beyond.sum()),
    )
    result.checks(shot, *errors)


def close(result: Result, cpu: float, wall: float, parts: dict[str, float]) -> None:
    """Closes a result with what it took, in seconds of processor time and of the clock; `parts` of
    the processor time are empty where nobody knows them.
    """
    packing = float(result.file["packing"].attrs["cpu_seconds"])
    openpmd.describe(
        result.file,
        parts,
        cpu_seconds=cpu + packing,
        cpu_seconds_collapse=cpu,
        cpu_seconds_packing=packing,
        wall_seconds=wall,
    )
    result.file.close()
