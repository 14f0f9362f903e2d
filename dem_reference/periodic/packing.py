"""A packing at rest under isotropic pressure, as looser or denser as its preparation asks."""

from pathlib import Path

from dem_reference.grains import Grains
from dem_reference.periodic.box import Box
from dem_reference.periodic.servo import Servo
from dem_reference.periodic.start import box_side

LOOSE = 0.50  # solid fraction from which the preparation compresses
FAST = 0.01  # inertial number that bounds its rate


def isotropic_packing(grains: Grains, point: dict, pressure: float, log: Path) -> Box:
    """Grains compressed to `pressure` [Pa] with the preparation's friction, then given their own.

    `point`: grains (number), seed, preparation_friction [-], time_step_fraction of the Rayleigh
    time. The less friction the preparation has, the denser the packing.
    """
    box = Box(
        grains,
        point["grains"],
        box_side(grains, point["grains"], LOOSE),
        point["seed"],
        point["preparation_friction"],
        point["time_step_fraction"] * grains.rayleigh_time(),
        log,
    )
    servo = Servo(box, pressure, rate_limit=grains.strain_rate(FAST, pressure))
    servo.isotropic(pressure)
    box.set_friction(grains.friction)
    servo.isotropic(pressure)
    return box
