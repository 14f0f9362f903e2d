"""The collapse of a dem.h5 again in LAMMPS, an independent DEM.

    python3 -m dem_reference.second_opinion DEM.h5... [-o TABLE.csv]

So that an engine's quirk is not taken for physics.

Grains start from the same settled positions; the tangential springs, which no file carries over,
build up again while the gate is still closed. The contact law is the same (Hertz, Mindlin, Tsuji
damping with the same realised restitution), but for the tangential spring's rescaling with the
overlap: trajectories differ, statistics should not. Rolling resistance is LAMMPS' `rolling sds`
(lammps.rolling_words says what differs).
"""

import sys
from math import sqrt
from pathlib import Path

import numpy as np
import pandas as pd

from cases import command_line, reading
from cases.case import parse
from cases.errors import EngineError, exit_code
from cases.files import check_table
from cases.provenance import typed
from cases.scenes import refuse_chute
from cases.scratch import temporary

from . import lammps, scene
from .plan import Plan
from .ensemble import save
from .grains import Grains
from .packing import drag
from .summary import quantile, scalars

COMPARED = (
    "run_out",
    "run_out_99",
    "highest_grain_at_wall",
    "kinetic_energy_peak",
    "kinetic_energy_peak_time",
    "released",
    "rotational_peak",
    "kinetic_energy_end",
)
LAWS = ("the same law", "gran/hertz/history")
SETTLING = 0.5  # time with the gate closed [sqrt(H/g)]


def contact_law(grains: Grains, gravity: float, name: str) -> dict[str, str]:
    """Words of LAMMPS for one of LAWS, between grains and at frictionless walls.

    The damping of gran/hertz/history goes with the contact's radius, not with its root: it is equal
    at `deep`. It knows neither rolling resistance nor walls of their own.
    """
    if name == LAWS[0]:
        tail = "damping tsuji"
        speed = sqrt(gravity * grains.diameter)
        rolling = lammps.rolling_words(grains, speed)
        at_wall = material_words(grains, grains.wall_restitution or grains.restitution)
        return {
            "pair": "granular",
            "coefficients": f"{material_words(grains, grains.restitution)} {grains.friction}"
            f"{rolling} {tail}",
            "wall": f"granular {at_wall} 0.0 {tail}",
        }
    r, m, y = grains.radius / 2, grains.mass / 2, grains.contact_modulus
    gamma = grains.damping_factor * sqrt(
        2 * y / (sqrt(r * lammps.deep(grains, sqrt(gravity * grains.diameter))) * m)
    )
    head = f"{4 / 3 * y:.17g} {8 * grains.contact_shear_modulus:.17g} {gamma:.17g} {gamma:.17g}"
    return {
        "pair": f"gran/hertz/history {head} {grains.friction} 1",
        "coefficients": "",
        "wall": f"hertz/history {head} 0.0 1",
    }


def material_words(grains: Grains, restitution: float) -> str:
    """Of a contact up to its friction."""
    entered = lammps.restitution_to_enter(restitution)
    head = f"hertz/material {grains.young_modulus:.17g} {entered:.12g}"
    return f"{head} {grains.poisson_ratio} tangential mindlin NULL 1.0"


def input_files(path: Path, folder: Path, law: str = LAWS[0]) -> tuple[str, dict]:
    """The LAMMPS input for a dem.h5; writes the grains to `folder`. Also the case."""
    with reading.result(path) as file:
        scene_of = parse(reading.attributes(file)["case_resolved"], path)
        refuse_chute(scene_of, "LAMMPS gives a second opinion")
        case = scene_of.values
        cloud = reading.group(file, "data/0/particles/cloud")
        kind = reading.values(cloud, "kind")
        x = reading.vectors(cloud, "position", len(kind))
        diameters = 2 * reading.values(cloud, "radius", len(kind))
        steps = int(reading.number(file, "steps"))
    grains, plan, geometry = Grains.of(case), Plan.of(case), case["geometry"]
    if (
        case["walls"]["front_back"] != "periodic"
        or case["walls"]["base"] != "glued"
        or case["walls"]["left"] != "smooth"
        or case["walls"]["gate"] != "instantaneous"
    ):
        raise EngineError(
            "second_opinion: only periodic sides, a glued base, a smooth left wall and a gate that "
            "is gone at once are set up in LAMMPS"
        )
    if law != LAWS[0] and (grains.rolls or grains.wall_restitution):
        raise EngineError(
            f"second_opinion: {law} has neither rolling resistance nor a restitution of the walls"
        )
    d = grains.diameter
    bounds = (
        (-d, geometry["floor_length"] + d),
        (-(scene.SAFETY_FLOOR + 1) * d, geometry["height"] + 2 * d),
        (0, geometry["thickness"]),
    )
    lines = ["grains", "", f"{len(x)} atoms", "2 atom types", ""]
    lines += [f"{low} {high} {axis}lo {axis}hi" for (low, high), axis in zip(bounds, "xyz")]
    lines += ["", "Atoms # sphere", ""]
    sizes = [f"{d}" if grains.even else f"{one:.17g}" for one in diameters]
    lines += [
        f"{k + 1} {1 if kind[k] == 1 else 2} {sizes[k]} {grains.density} "
        f"{a:.17g} {b:.17g} {c % geometry['thickness']:.17g}"
        for k, (a, b, c) in enumerate(x)
    ]
    (folder / "grains.data").write_text("\n".join(lines) + "\n")
    text = scene.render(
        "second_opinion",
        data="grains.data",
        skin=scene.CELL_SKIN * d,
        **contact_law(grains, geometry["gravity"], law),
        dt=f"{plan.dt:.17g}",
        gravity=geometry["gravity"],
        floor=scene.floor_height(case, grains),
        gate=geometry["length"],
        drag=drag(case, grains, 1.0),
        settle=round(SETTLING * plan.scale / plan.dt),
        row=plan.row,
        steps=steps,
    )
    return text, case


def run(path: Path, folder: Path, law: str = LAWS[0]) -> dict:
    """Runs LAMMPS in `folder` on the grains of a dem.h5; returns the case."""
    text, case = input_files(path, folder, law)
    lammps.run(text, folder)
    return case


def collapse(path: Path) -> dict[str, float]:
    """COMPARED scalars of the LAMMPS run that answers to a dem.h5, defined as in summary.py."""
    with temporary() as folder:
        case = run(path, folder)
        history = thermo(folder / "log.lammps")
        x, y, _, radius = np.loadtxt(folder / "final.txt", skiprows=9)[:, 1:].T
    plan, geometry, d = Plan.of(case), case["geometry"], Grains.of(case).diameter
    step, kinetic, rotational, potential = history[:, 0], *history[:, 3:].T
    peak, released, ordered = kinetic.argmax(), potential[0] - potential[-1], np.argsort(x)
    mass = radius[ordered] ** 3
    values = (
        quantile(x[ordered], mass, 0.995) / geometry["length"] - 1,
        quantile(x[ordered], mass, 0.99) / geometry["length"] - 1,
        (y + radius)[x < 1.5 * d].max() / geometry["height"],
        kinetic[peak] / potential[0],
        step[peak] * plan.dt / plan.scale,
        released,
        rotational.max() / released,
        kinetic[-1] / kinetic[peak],
    )
    return dict(zip(COMPARED, map(float, values)))


def thermo(log: Path) -> np.ndarray:
    """Rows of the log's last thermo table: step, time, atoms, kinetic, rotational, potential."""
    tables = log.read_text(errors="replace").split("Step Time Atoms")
    lines = tables[-1].splitlines()[1:]
    rows = [
        line.split()
        for line in lines[: next(k for k, line in enumerate(lines) if line.startswith("Loop time"))]
    ]
    return np.array([[float(word) for word in row] for row in rows if row and row[0].isdigit()])


def main() -> int:
    parser = command_line.Parser(
        prog="dem_reference.second_opinion", description=__doc__.split("\n")[0]
    )
    parser.add_argument("runs", nargs="+", type=Path, metavar="DEM.h5")
    parser.add_argument(
        "-o", "--output", type=Path, help="table (CSV) with a row per run and engine"
    )
    options = parser.parse_args()
    if options.output:
        check_table(options.output)
    rows = []
    for run in options.runs:
        ours = scalars(run)
        rows.append(
            {"seed": ours["seed"], "engine": "liggghts"} | {name: ours[name] for name in COMPARED}
        )
        rows.append({"seed": ours["seed"], "engine": "lammps"} | collapse(run))
    table = pd.DataFrame(rows)
    if options.output:
        save(
            table,
            options.output,
            typed("python3 -m dem_reference.second_opinion", sys.argv[1:]),
            "units as in ensemble.csv; LAMMPS starts from the same settled positions",
        )
    means = table.groupby("engine")[list(COMPARED)].agg(["mean", "std"])
    print(means.T.unstack().to_string(float_format=lambda value: f"{value:.4g}"))
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(main))
