"""Two grains collide head-on with a given share of the Rayleigh time as step: what the step does to
the collision.
"""

from functools import cache
from pathlib import Path

from cases.case import load
from cases.errors import EngineError
from compare.study.failure import classify
from dem_reference.collision import COLUMNS, table
from dem_reference.grains import LEAST_STEPS_PER_CONTACT, Grains


@cache
def collisions(scene: Path, sets: tuple[str, ...], fraction: float):
    case = load(scene, sets).values
    return table(case, Grains.of(case).young_modulus, fraction)


def collide(
    scene: Path, sets: tuple[str, ...], fraction: float, speed: float, tolerance: float
) -> dict:
    """Class of the collision at `speed` [m/s]: "energy growth" when the grains part faster than
    they met, "inaccurate" when the restitution is off by more than `tolerance` (relative), "lost
    grains" when they never part.
    """
    try:
        rows = collisions(scene, sets, fraction)
    except EngineError as error:
        return {"status": classify(error.code), "message": str(error)}
    name = {column: i for i, column in enumerate(COLUMNS)}
    row = next(row for row in rows if row[name["speed"]] == speed and row[name["angle"]] == 0.0)
    restitution, asked = row[name["restitution"]], load(scene, sets)["grains.restitution"]
    steps = row[name["steps"]]
    said = f"restitution {restitution:.3f} of {asked:g} asked, {steps:.0f} steps in contact"
    command = (
        f"python3 -m dem_reference.collision {scene} {' '.join(f'--set {word}' for word in sets)} "
        f"--set dem.time_step_fraction={fraction:.4g}"
    )
    status = (
        "energy growth"
        if restitution > 1.0
        else "inaccurate"
        if abs(restitution / asked - 1.0) > tolerance
        else "ok"
    )
    return {"status": status, "message": said, "command": command}


def least_steps_fraction(scene: Path, sets: tuple[str, ...], speed: float) -> float:
    """The share of the Rayleigh time at which a contact of that speed lasts the fewest steps
    allowed.
    """
    grains = Grains.of(load(scene, sets).values)
    return grains.contact_time(speed) / (LEAST_STEPS_PER_CONTACT * grains.rayleigh_time())
