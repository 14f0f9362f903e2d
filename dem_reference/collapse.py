"""The collapse of a settled packing, audited while it runs."""

import shutil
import time
from dataclasses import dataclass
from math import sqrt
from pathlib import Path

import numpy as np

from cases import openpmd
from cases.errors import EngineError, Failure

from . import scene
from .audit import Audit, without_split
from .contacts import Snapshot
from .engine import Liggghts
from .grains import Grains, time_step
from .moment import Moment, planes_of
from .output import Result
from .packing import RESTART
from .spent import Spent


@dataclass(frozen=True)
class Plan:
    """Steps of a run: every interval is a whole multiple of the shorter one.

    So pieces of the run always end alike.
    """

    dt: float  # [s]
    sample: int  # steps between samples of the contacts
    row: int  # between rows of the energy history
    frame: int  # between frames
    last: int  # at most
    scale: float  # sqrt(H/g) [s]

    @classmethod
    def of(cls, case: dict) -> "Plan":
        geometry, t = case["geometry"], case["time"]
        grains = Grains.of(case)
        dt = time_step(
            grains, case["dem"]["time_step_fraction"], geometry["height"], geometry["gravity"]
        )
        scale = sqrt(geometry["height"] / geometry["gravity"])
        wanted = max(1, round(t["energy_interval"] * scale / dt))
        sample = min(case["dem"]["audit_interval"] or wanted, wanted)
        row = sample * max(1, round(wanted / sample))
        frame = row * max(1, round(t["frame_interval"] * scale / dt / row))
        last = frame * max(1, round(t["maximum"] * scale / dt / frame))
        return cls(dt, sample, row, frame, last, scale)


def release(case: dict, grains: Grains, plan: Plan, packing: Path, work: Path) -> str:
    """Commands from the settled packing to the instant of release.

    The gate is gone by then, or about to be lifted. They are for an engine that works in the folder
    `work`, where the files that they name are put.
    """
    shutil.copyfile(packing / RESTART, work / RESTART)
    commands = [
        scene.beginning(case, grains, f"read_restart {RESTART}", grains.young_modulus),
        scene.material(case, grains, grains.young_modulus, grains.friction),
        scene.bodies(case, grains),
        f"timestep {plan.dt:.17g}",
        scene.lifted_gate(case, grains, work / "gate.stl")
        if case["walls"]["gate"] == "lifted"
        else "",
        f"thermo {plan.row}",
        "reset_timestep 0",
        "run 0",
    ]
    return "\n".join(commands)


class Column:
    """The grains while they collapse: the engine, and what is looked at of it."""

    def __init__(self, case: dict, packing: Path, log: Path):
        """From the settled `packing`, a folder, to the instant of release."""
        self.case, self.grains, self.plan = case, Grains.of(case), Plan.of(case)
        geometry, walls = case["geometry"], case["walls"]
        self.engine = Liggghts(log)
        self.engine.commands(release(case, self.grains, self.plan, packing, log.parent))
        self.count, self.walls = self.engine.count(), scene.planes(case, self.grains)
        self.thickness = geometry["thickness"] if walls["front_back"] == "periodic" else None
        self.moment = Moment(self.grains, self.plan.dt, geometry["gravity"], self.thickness)
        self.lifted = walls["gate"] == "lifted"
        beyond = geometry["height"] + self.grains.diameter
        self.gate_gone = beyond / walls["gate_speed"] if self.lifted else 0.0  # [s]

    def standing(self, now: float) -> list[scene.Plane]:
        """The walls that stand."""
        gate = [scene.rising_gate(self.case, now)] if now < self.gate_gone else []
        return self.walls + gate

    def look(self, now: float) -> Moment:
        """All grains and contacts, `now` [s] after the release; valid until the engine goes on."""
        rows, count = self.engine.held_contacts()
        self.moment.look(self.engine.held(), rows, count, planes_of(self.standing(now)))
        return self.moment

    def snapshot(self, now: float) -> Snapshot:
        """The same as a copy."""
        gravity = self.case["geometry"]["gravity"]
        atoms, rows = self.engine.atoms(), self.engine.contacts()
        return Snapshot(
            self.grains, atoms, rows, self.plan.dt, gravity, self.thickness, self.standing(now)
        )

    def kinetic_on_floor(self) -> float:
        """Translational kinetic energy of the moving grains that are still on the floor [J]."""
        mobile = self.engine.integers("type") == scene.TYPES["grain"]
        mobile &= ~beyond_floor(self.engine.vectors("x"), self.case)
        v = self.engine.vectors("v")[mobile]
        return self.grains.mass / 2 * float((v * v).sum())

    def drop_gate(self, now: float) -> None:
        """Removes a gate that has been lifted beyond the column."""
        if self.lifted and now >= self.gate_gone:
            self.engine.commands(scene.REMOVE_LIFTED_GATE + "\nrun 0")
            self.lifted = False

    def refuse_losses(self, now: float) -> None:
        lost = self.count - self.engine.count()
        if lost:
            raise EngineError(
                f"LIGGGHTS: lost {lost} of {self.count} grains by t = {now:.4g} s",
                Failure.LOST_GRAINS,
            )


def collapse(case: dict, packing: Path, log: Path, target: Path, attributes: dict, report) -> None:
    """Runs the collapse in this process and writes `target`.

    Ends at rest (kinetic energy on the floor below time.rest_kinetic_energy of its peak, past the
    peak) or at time.maximum. Grains that have rolled off the floor's end never stop, and the
    deposit does not wait for them.
    """
    began, spent = time.monotonic(), Spent()
    column = Column(case, packing, log)
    plan, sampled = column.plan, case["dem"]["audit_interval"] > 0
    spent.began()
    with spent.on("audit"):
        audit = audit_of(case, column)
    step, peak, reason = 0, 0.0, "maximum"

    def frame() -> Snapshot:
        now = step * plan.dt
        with spent.on("output"):
            shot = column.snapshot(now)
            gone = audit.accounts.by_grain(column.moment) if sampled else None
            result.frame(step, now, shot, case["output"]["contacts"], gone)
        return shot

    with spent.on("output"):
        result = Result(target, attributes)
    shot = frame()
    while step < plan.last and reason != "rest":
        with spent.on("engine"):
            column.engine.advance(plan.sample)
        step += plan.sample
        now = step * plan.dt
        with spent.on("audit"):
            moment = column.look(now)
            if sampled:
                audit.accounts.add(moment)
            if step % plan.row == 0:
                column.refuse_losses(now)
                audit.row(moment, now)
                peak = max(peak, moment.held.kinetic)
                quiet = case["time"]["rest_kinetic_energy"] * peak
                if now > plan.scale and column.kinetic_on_floor() < quiet:
                    reason = "rest"
        if step % plan.row == 0:
            report(step / plan.last, f"collapse t = {now / plan.scale:.2f} sqrt(H/g)")
        if step % plan.frame == 0 or reason == "rest" or step >= plan.last:
            shot = frame()
        with spent.on("engine"):
            column.drop_gate(now)
    with spent.on("output"):
        write_history(result, audit, sampled)
        finish(result, packing, case, shot, plan, reason, step, audit.force_error)
    cpu, wall = time.process_time(), time.monotonic() - began
    close(result, cpu, wall, spent.attributes())


def audit_of(case: dict, column: Column) -> Audit:
    """The accounts of a collapse, at its release."""
    plan, gravity = column.plan, case["geometry"]["gravity"]
    return Audit(
        plan.sample * plan.dt,
        plan.sample == 1,
        column.grains.binary_contact_time(gravity),
        case["dem"]["lifetime_threshold"],
        column.look(0.0),
        scene.axisymmetric(case),
    )


def write_history(result: Result, audit: Audit, sampled: bool) -> None:
    if not sampled:
        result.history(without_split(audit.rows))
        return
    audit.accounts.finish()
    result.history(audit.rows)
    result.lifetimes(audit)


def beyond_floor(x: np.ndarray, case: dict) -> np.ndarray:
    """Which of the grains at x, (n, 3) [m], have left the floor at its end (n,)."""
    reach = np.hypot(x[:, 0], x[:, 2]) if scene.axisymmetric(case) else x[:, 0]
    return reach > case["geometry"]["floor_length"]


def finish(
    result: Result,
    packing: Path,
    case: dict,
    shot: Snapshot,
    plan: Plan,
    reason: str,
    step: int,
    force_error: float,
) -> None:
    """Puts into a result its packing and what is known only at the end."""
    result.packing(packing / "packing.h5")
    beyond = beyond_floor(shot.atoms["x"][shot.mobile], case)
    openpmd.describe(
        result.file,
        end_reason=reason,
        steps=step,
        time_scale=plan.scale,
        force_error=force_error,
        grains_beyond_floor=int(beyond.sum()),
    )


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
