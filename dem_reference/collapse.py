"""The collapse of a settled packing, audited while it runs."""

import shutil
import time
from dataclasses import dataclass
from math import sqrt
from pathlib import Path

import numpy as np

from cases.errors import EngineError, Failure

from . import scene
from .audit import Audit, without_split
from .contacts import Snapshot
from .engine import Liggghts
from .grains import Grains, time_step
from .lifetimes import Lifetimes
from .output import Result
from .packing import RESTART


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
        self.largest_id = int(self.engine.atoms()["id"].max())
        self.lifted = walls["gate"] == "lifted"
        beyond = geometry["height"] + self.grains.diameter
        self.gate_gone = beyond / walls["gate_speed"] if self.lifted else 0.0  # [s]

    def look(self, now: float) -> Snapshot:
        """All grains and contacts, `now` [s] after the release."""
        gate = [scene.rising_gate(self.case, now)] if now < self.gate_gone else []
        return Snapshot(
            self.grains,
            self.engine.atoms(),
            self.engine.contacts(self.largest_id),
            self.plan.dt,
            self.case["geometry"]["gravity"],
            self.thickness,
            self.walls + gate,
            scene.axisymmetric(self.case),
        )

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
    began = time.monotonic(), time.process_time()
    column = Column(case, packing, log)
    plan, sampled = column.plan, case["dem"]["audit_interval"] > 0
    lifetimes = Lifetimes(
        plan.sample * plan.dt,
        column.grains.binary_contact_time(case["geometry"]["gravity"]),
        case["dem"]["lifetime_threshold"],
    )
    shot = column.look(0.0)
    audit = Audit(plan.sample * plan.dt, plan.sample == 1, lifetimes, shot)
    result = Result(target, attributes)

    def frame():
        gone = audit.dissipated(shot) if sampled else None
        result.frame(step, step * plan.dt, shot, case["output"]["contacts"], gone)

    step, peak, reason = 0, 0.0, "maximum"
    frame()
    while step < plan.last and reason != "rest":
        column.engine.advance(plan.sample)
        step += plan.sample
        now = step * plan.dt
        shot = column.look(now)
        if sampled:
            audit.add(shot)
        column.drop_gate(now)
        if step % plan.row == 0:
            column.refuse_losses(now)
            audit.row(shot, now)
            peak = max(peak, shot.kinetic)
            report(step / plan.last, f"collapse t = {now / plan.scale:.2f} sqrt(H/g)")
            quiet = case["time"]["rest_kinetic_energy"] * peak
            if now > plan.scale and kinetic_on_floor(shot, case) < quiet:
                reason = "rest"
        if step % plan.frame == 0 or reason == "rest" or step >= plan.last:
            frame()
    lifetimes.finish()
    if sampled:
        result.history(audit.rows)
        result.lifetimes(audit)
    else:
        result.history(without_split(audit.rows))
    cpu, wall = time.process_time() - began[1], time.monotonic() - began[0]
    finish(result, packing, case, shot, plan, reason, step, audit.force_error, cpu, wall)


def beyond_floor(shot: Snapshot, case: dict) -> np.ndarray:
    """Which of the moving grains have left the floor at its end (n,)."""
    x, _, z = shot.atoms["x"][shot.mobile].T
    return (np.hypot(x, z) if scene.axisymmetric(case) else x) > case["geometry"]["floor_length"]


def kinetic_on_floor(shot: Snapshot, case: dict) -> float:
    """Translational kinetic energy of the moving grains that are still on the floor [J]."""
    v = shot.atoms["v"][shot.mobile][~beyond_floor(shot, case)]
    return shot.grains.mass / 2 * float((v * v).sum())


def finish(
    result: Result,
    packing: Path,
    case: dict,
    shot: Snapshot,
    plan: Plan,
    reason: str,
    step: int,
    force_error: float,
    cpu: float,
    wall: float,
) -> None:
    """Closes a result with its packing and what is known only at the end."""
    result.packing(packing / "packing.h5")
    packing_cpu = float(result.file["packing"].attrs["cpu_seconds"])
    beyond = beyond_floor(shot, case)
    result.file.attrs.update(
        end_reason=reason,
        steps=step,
        time_scale=plan.scale,
        cpu_seconds=cpu + packing_cpu,
        cpu_seconds_collapse=cpu,
        cpu_seconds_packing=packing_cpu,
        wall_seconds=wall,
        force_error=force_error,
        grains_beyond_floor=int(beyond.sum()),
    )
    result.file.close()
