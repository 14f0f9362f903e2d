"""Two grains collide: restitution realised against the one asked, and energy balance.

    python3 -m dem_reference.collision CASE [--set key=value]...

Over speed and angle: many pairs, far apart, collide in one run without gravity; each is audited at
every step.
"""

import sys
from pathlib import Path

import numpy as np

from cases import command_line
from cases.case import load
from cases.errors import CaseError, EngineError, Failure
from cases.scratch import temporary

from . import scene
from .contacts import Snapshot, dot
from .engine import Liggghts
from .grains import Grains
from .process import Report, run_engine

# Relative, along the line of centres [m/s]; the last is sqrt(2 g H) of the seed's column.
SPEEDS = (0.01, 0.1, 0.5, 1.4)
ANGLES = (0.0, 30.0, 60.0)  # of the relative velocity to the line of centres [degrees]
GAP = 2.0  # steps before they meet
LANE = 5.0  # distance between pairs, in diameters
COLUMNS = (
    "speed",
    "angle",
    "restitution",
    "tangential_restitution",
    "loss",
    "work_residual",
    "power_residual",
    "steps",
)
BODIES = """\
set type 1 density {density} diameter {diameter}
group mobile type 1
fix motion mobile nve/sphere
compute pairs all pair/gran/local id history delta
compute id_sum all reduce sum c_pairs[1]
timestep {dt:.17g}
thermo 1000000
run 0
"""


def collide(case: dict, grains: Grains, dt: float, log: Path, report: Report) -> np.ndarray:
    """Runs every pair in this process; returns (pairs, COLUMNS).

    restitution = -u_n'/u_n, each along its own line of centres; tangential_restitution = slip after
    / slip before (1 without slip: 0/0 is given as 1); loss, work_residual (work on the contact
    against kinetic energy lost) and power_residual (dissipated power likewise) are relative to the
    kinetic energy of the relative motion.
    """
    speed, angle = (a.ravel() for a in np.meshgrid(SPEEDS, np.radians(ANGLES), indexing="ij"))
    pairs, mass, inertia = speed.size, grains.mass, grains.inertia
    v = np.column_stack([speed, speed * np.tan(angle), 0 * speed]) / 2
    engine = place(case, grains, dt, speed, v, log)

    work, power, steps, normal_after, slip_after = (np.zeros(pairs) for _ in range(5))
    touched = np.zeros(pairs, dtype=bool)
    longest = 3 * grains.contact_time(min(SPEEDS)) + 2 * GAP * dt
    for _ in range(int(longest / dt) + 1):
        engine.advance(1)
        atoms = engine.atoms()
        shot = Snapshot(grains, atoms, engine.contacts(), dt, 0.0, None, [])
        pair = (atoms["id"][shot.i] - 1) % pairs
        np.add.at(work, pair, shot.work_rate_parts.sum(axis=1) * dt)
        np.add.at(power, pair, shot.power_parts.sum(axis=1) * dt)
        steps[pair] += 1
        order = np.argsort(atoms["id"])
        x, u, spin = (atoms[name][order].reshape(2, pairs, 3) for name in ("x", "v", "omega"))
        along, slip = relative_motion(grains, x, u, spin)
        touching = np.zeros(pairs, dtype=bool)
        touching[pair] = True
        parted = touched & ~touching
        normal_after[parted], slip_after[parted] = along[parted], slip[parted, 1]
        touched = touching
    if touched.any() or not steps.all():
        raise EngineError(
            "collision: a pair has not met and parted (contact longer than three Hertz times)",
            Failure.LOST_GRAINS,
        )
    before = mass * dot(v, v)
    lost = before - sum(
        mass / 2 * dot(u[k], u[k]) + inertia / 2 * dot(spin[k], spin[k]) for k in (0, 1)
    )
    slip_before = 2 * v[:, 1]
    oblique = slip_before > 0
    return np.column_stack(
        [
            speed,
            np.degrees(angle),
            normal_after / speed,
            np.where(oblique, slip_after / np.where(oblique, slip_before, 1), 1.0),
            lost / before,
            (work - lost) / before,
            (power - lost) / before,
            steps,
        ]
    )


def place(
    case: dict, grains: Grains, dt: float, speed: np.ndarray, v: np.ndarray, log: Path
) -> Liggghts:
    """Every pair about to meet at `speed`, (pairs,): the first grains at `v`, the others at -v."""
    d = grains.diameter
    lanes = np.arange(speed.size)
    centre = np.column_stack(
        [(lanes % 4 + 1) * LANE * d, (lanes // 4 + 1) * LANE * d, 0 * lanes + LANE * d]
    )
    half = np.column_stack([d / 2 + GAP * speed * dt / 2, 0 * speed, 0 * speed])
    free = case | {"walls": case["walls"] | {"front_back": "smooth"}}
    size = LANE * d * (5 + lanes.size // 4)
    box = f"region domain block 0 {size} 0 {size} 0 {size} units box\ncreate_box 5 domain"
    engine = Liggghts(log, grains)
    engine.commands(scene.beginning(free, grains, box, grains.young_modulus))
    engine.commands(scene.material(free, grains, grains.young_modulus, grains.friction))
    engine.create(np.vstack([centre - half, centre + half]))
    engine.commands(BODIES.format(density=grains.density, diameter=d, dt=dt))
    ids = engine.atoms()["id"] - 1
    engine.vectors("v")[:] = np.vstack([v, -v])[ids]
    engine.command("run 0")
    return engine


def relative_motion(
    grains: Grains, x: np.ndarray, u: np.ndarray, spin: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Relative velocity of each pair along its line of centres, (pairs,), and slip, (pairs, 3).

    Of positions, velocities and spins, (2, pairs, 3).
    """
    normal = (x[0] - x[1]) / np.linalg.norm(x[0] - x[1], axis=1)[:, None]
    along = dot(u[0] - u[1], normal)
    rolling = np.cross(grains.radius * (spin[0] + spin[1]), normal)
    return along, u[0] - u[1] - along[:, None] * normal - rolling


def table(case: dict, young_modulus: float, fraction: float) -> np.ndarray:
    """The collisions of a case's grains, (pairs, COLUMNS).

    At a stiffness [Pa] and a fraction of the Rayleigh time.
    """
    grains = Grains.of(case, young_modulus)
    dt = fraction * grains.rayleigh_time()
    with temporary() as folder:
        log = folder / "log"
        return run_engine(collide, case, grains, dt, log, log=log).result


def main() -> int:
    parser = command_line.Parser(prog="dem_reference.collision", description=__doc__.split("\n")[0])
    parser.add_argument("case", metavar="CASE")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    options = parser.parse_args()
    try:
        case = load(options.case, options.set).values
        rows = table(case, Grains.of(case).young_modulus, case["dem"]["time_step_fraction"])
    except (CaseError, EngineError) as error:
        print(error, file=sys.stderr)
        return 2 if isinstance(error, CaseError) else 3
    print(" ".join(f"{name:>22}" for name in COLUMNS))
    for row in rows:
        print(" ".join(f"{value:22.6g}" for value in row))
    return 0


if __name__ == "__main__":
    sys.exit(main())
