"""Commands from a settled packing to the instant of its release."""

import shutil
from pathlib import Path

from . import plates, scene
from .grains import Grains
from .packing import RESTART
from .plan import Plan

RELEASE = "reset_timestep 0\nrun 0"


def settled(case: dict, grains: Grains, packing: Path, work: Path | None, ranks: str = "") -> str:
    """Commands that read the settled packing, for an engine that works in the folder `work`, where
    the file that they name is put; None: somebody else puts it there. ranks: as of
    scene.beginning.
    """
    if work:
        shutil.copyfile(packing / RESTART, work / RESTART)
    return scene.beginning(
        case, grains, f"read_restart {RESTART}", grains.young_modulus, ranks=ranks
    )


def acting(case: dict, grains: Grains, plan: Plan, work: Path | None, lifted: bool) -> str:
    """Commands for all that acts on the grains once they are released; `lifted`: a gate that rises,
    whose file is put into `work`, as of `settled`.
    """
    commands = [
        scene.material(case, grains, grains.young_modulus, grains.friction),
        scene.bodies(case, grains),
        f"timestep {plan.dt:.17g}",
        plates.lifted_gate(case, grains, work) if lifted else "",
        plates.silo(case, grains, work) if scene.silo(case) else "",
        f"thermo {plan.row}",
    ]
    return "\n".join(commands)


def release(case: dict, grains: Grains, plan: Plan, packing: Path, work: Path) -> str:
    """Commands from the settled packing to the instant of release: the gate is gone by then, or
    about to be lifted.
    """
    lifted = case["walls"]["gate"] == "lifted"
    begin, act = settled(case, grains, packing, work), acting(case, grains, plan, work, lifted)
    return "\n".join([begin, act, released(case)])


def released(case: dict) -> str:
    """Commands at the instant of release, when all that acts is there."""
    if velocity := case["initial"]["velocity"]:  # of a chute, at half of its height
        top = case["geometry"]["height"]
        ramp = f"velocity mobile ramp vx 0 {2 * velocity:.17g} y 0 {top:.17g} sum yes units box"
        return f"{ramp}\n{RELEASE}"
    if not scene.silo(case):
        return RELEASE
    return plates.RAISE.format(case["geometry"]["fall"]) + "\n" + RELEASE
