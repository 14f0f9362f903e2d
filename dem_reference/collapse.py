"""The collapse of a settled packing, audited while it runs."""

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


@dataclass(frozen=True)
class Plan:
    """Steps of a run: every interval a whole multiple of the shorter one, so that pieces of the run always end alike."""

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
    """Commands from the settled packing to the instant of release, the gate gone or about to be lifted; may write to `work`."""
    commands = [
        scene.beginning(
            case, grains, f"read_restart {packing / 'packing.restart'}", grains.young_modulus
        ),
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


def collapse(case: dict, packing: Path, log: Path, target: Path, attributes: dict, report) -> None:
    """Runs the collapse in this process and writes `target`.

    Ends at rest (kinetic energy on the floor below time.rest_kinetic_energy of its peak, past the peak) or at time.maximum.
    Grains that have rolled off the floor's end never stop, and the deposit does not wait for them.
    """
    began = time.monotonic(), time.process_time()
    grains, plan, geometry = Grains.of(case), Plan.of(case), case["geometry"]
    engine = Liggghts(log)
    engine.commands(release(case, grains, plan, packing, log.parent))
    count, walls = engine.count(), scene.planes(case, grains)
    thickness = geometry["thickness"] if case["walls"]["front_back"] == "periodic" else None
    largest_id = int(engine.atoms()["id"].max())

    lifted = case["walls"]["gate"] == "lifted"
    gate_gone = (
        (geometry["height"] + grains.diameter) / case["walls"]["gate_speed"] if lifted else 0.0
    )

    def look(now: float) -> Snapshot:
        gate = [scene.rising_gate(case, now)] if now < gate_gone else []
        return Snapshot(
            grains,
            engine.atoms(),
            engine.contacts(largest_id),
            plan.dt,
            geometry["gravity"],
            thickness,
            walls + gate,
            scene.axisymmetric(case),
        )

    sampled = case["dem"]["audit_interval"] > 0
    lifetimes = Lifetimes(
        plan.sample * plan.dt,
        grains.binary_contact_time(geometry["gravity"]),
        case["dem"]["lifetime_threshold"],
    )
    audit = Audit(plan.sample * plan.dt, plan.sample == 1, lifetimes)
    result = Result(target, attributes)
    shot = look(0.0)
    audit.begin(shot)
    result.frame(0, 0.0, shot, case["output"]["contacts"])
    step, peak, reason = 0, 0.0, "maximum"
    while step < plan.last:
        engine.advance(plan.sample)
        step += plan.sample
        now = step * plan.dt
        shot = look(now)
        if sampled:
            audit.add(shot)
        if lifted and now >= gate_gone:
            engine.commands(scene.REMOVE_LIFTED_GATE + "\nrun 0")
            lifted = False
        if step % plan.row == 0:
            if engine.count() != count:
                raise EngineError(
                    f"LIGGGHTS: lost {count - engine.count()} of {count} grains by t = {now:.4g} s",
                    Failure.LOST_GRAINS,
                )
            audit.row(shot, now)
            peak = max(peak, shot.kinetic)
            report(step / plan.last, f"collapse t = {now / plan.scale:.2f} sqrt(H/g)")
            if (
                now > plan.scale
                and kinetic_on_floor(shot, case) < case["time"]["rest_kinetic_energy"] * peak
            ):
                reason = "rest"
        if step % plan.frame == 0 or reason == "rest" or step >= plan.last:
            result.frame(step, now, shot, case["output"]["contacts"])
        if reason == "rest":
            break
    lifetimes.finish()
    if sampled:
        result.history(audit.rows)
        result.lifetimes(audit)
    else:
        result.history(without_split(audit.rows))
    finish(
        result,
        packing,
        case,
        shot,
        plan,
        reason,
        step,
        audit.force_error,
        time.process_time() - began[1],
        time.monotonic() - began[0],
    )


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
