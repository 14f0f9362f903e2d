"""LAMMPS as a DEM engine: the restitution it realises, and running an input."""

from math import log, pi, sqrt
from pathlib import Path

from scipy.optimize import brentq

from cases.errors import EngineError
from cases.programs import call

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
