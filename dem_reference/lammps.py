"""LAMMPS as a DEM engine: the restitution and the rolling resistance it realises, and running an
input.
"""

from math import log, pi, sqrt
from pathlib import Path

from scipy.optimize import brentq

from cases.errors import EngineError
from cases.programs import call

from .grains import Grains

PROGRAM = "lmp"
# Of LAMMPS' documentation: pair_style granular, damping tsuji.
TSUJI = (1.2728, -4.2783, 11.087, -22.348, 27.467, -18.022, 4.8218)


def restitution_to_enter(restitution: float) -> float:
    """The coefficient of restitution to type so that `restitution` is the one realised [-].

    For a Hertz contact with damping proportional to sqrt(m k) the exact ratio is
    -sqrt(5) ln e/sqrt(ln^2 e + pi^2) (Tsuji, Tanaka & Ishida 1992; as in LIGGGHTS); LAMMPS
    evaluates a polynomial fit in its place, which is off by 0.03 in e at e = 0.88. The polynomial
    is inverted here.
    """
    wanted = -sqrt(5) * log(restitution) / sqrt(log(restitution) ** 2 + pi**2)
    return brentq(lambda e: sum(c * e**i for i, c in enumerate(TSUJI)) - wanted, 0.01, 1.0)


def deep(grains: Grains, speed: float) -> float:
    """Overlap at the deepest of a collision at `speed` [m/s], in m:

    (15 m* v^2/(16 Y* sqrt(R*)))^(2/5).
    """
    r, m, y = grains.radius / 2, grains.mass / 2, grains.contact_modulus
    return (15 * m * speed**2 / (16 * y * sqrt(r))) ** 0.4


def rolling_words(grains: Grains, speed: float, bound: float | None = None) -> str:
    """LAMMPS' `rolling sds` for the rolling resistance of grains that collide at about `speed`
    [m/s]; none without it. `bound`: in place of mu_r.

    Its force k u + gamma du/dt, with du/dt = R* w x n, acts at the arm R* and is cut to mu_r |F_n|:
    the same bound of the torque as LIGGGHTS'. Stiffness and damping are k_r/R*^2 and the dashpot's
    coefficient over R*^2, but constants in LAMMPS, where LIGGGHTS' follow the overlap: they are
    taken equal at `deep`. LAMMPS cuts the sum of spring and dashpot, LIGGGHTS the spring, and adds
    no dashpot then; LAMMPS turns the spring with the contact, LIGGGHTS does not.
    """
    if not grains.rolls:
        return ""
    r, m, y = grains.radius / 2, grains.mass, grains.contact_modulus
    root, mu = sqrt(r * deep(grains, speed)), grains.rolling_friction
    damping = 0.0
    if grains.rolling_model == "epsd":
        k = 2.25 * 4 / 3 * y * root * mu**2
        inertia = 1.4 * m * grains.radius**2 / 2
        damping = 2 * grains.rolling_damping * sqrt(inertia * k * r**2) / r**2
    else:
        k = 8 * grains.contact_shear_modulus * root
    return f" rolling sds {k:.17g} {damping:.17g} {mu if bound is None else bound:.17g}"


def run(script: str, folder: Path) -> None:
    """Runs `script` in `folder` on one core; raises EngineError with LAMMPS's own message."""
    (folder / "in.lammps").write_text(script)
    words = [PROGRAM, "-in", "in.lammps", "-log", "log.lammps", "-screen", "none"]
    done = call(words, cwd=folder)
    log_file = folder / "log.lammps"
    said = log_file.read_text(errors="replace") if log_file.exists() else ""
    errors = [line for line in said.splitlines() if line.startswith("ERROR")]
    if done.returncode or errors:
        raise EngineError(
            f"lammps: {errors[0] if errors else done.stderr.strip()[-200:]} "
            f"(exit code {done.returncode}) see {log_file}"
        )
