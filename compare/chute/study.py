"""Flows down a plane of several inclinations and depths, of the grains and of every law.

    python3 -m compare.chute.study [CASE] [-o FOLDER] [--only mpm|dem] [--start]

Runs that are there are kept (runs/studies/chute). Written to FOLDER, by default cases/<case>/
reference: steady.csv, with a row for each run, and steady.png; with --start start.csv instead: at
which inclination a settled layer of grains begins to flow.
"""

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from cases import case, command_line, content, provenance
from cases.errors import CaseError, exit_code
from cases.files import write_table
from cases.lookup import find_case
from cases.programs import kept
from compare.chute import charts, published, sides
from compare.chute.flow import power
from compare.chute.words import WORDS
from compare.study.recipe import Recipe
from dem_reference.content import ensemble_key

ANGLES = (24.0, 26.0, 28.0)
DEPTHS = (8.0, 12.0, 18.0)  # of grains at the case's inclination [d]
LAWS = {  # with the card that its constants are taken from
    "drucker_prager": "dem_mu05",
    "mu_i": "",
    "solid_fluid": "dem_mu05",
    "contact_share": "contact_mu05",
}
LONGER = 2.0  # times the case's time, for the grains, whose means need it
# Of the case's time, for the continuum: before points of the fastest flow leave their rows.
SHORTER = 0.75
COLUMNS = (
    "engine",
    "law",
    "inclination",
    "height",
    "end_reason",
    "state",
    *WORDS,
    "solid_fraction_scatter",
    "published_solid_fraction",
    "published_inertial_number",
    "cpu_seconds",
    "failure",
)


STARTS = (19.0, 20.0, 21.0, 22.0, 23.0)
STARTED = 40.0  # sqrt(H/g): by then a layer flows, or has come to rest


@dataclass(frozen=True)
class Task:
    recipe: Recipe
    law: str
    inclination: float
    height: float  # [d]


def plan(scene: case.Case, only: str = "") -> list[Task]:
    """Grains of every angle and depth, and each law at every angle."""
    d, own = scene["grains.diameter"], scene["geometry.inclination"]
    layer = scene["geometry.height"] / d
    places = [(angle, layer) for angle in ANGLES]
    places += [(own, depth) for depth in DEPTHS if abs(depth - layer) > 0.01]
    out = []
    for angle, depth in places:
        # times are told in sqrt(H/g): frames stay as far apart, and a layer takes the longer the
        # deeper it is
        sets = [f"geometry.inclination={angle}"]
        sets += [f"time.maximum={float(LONGER * scene['time.maximum'])!r}"]
        if abs(depth - layer) > 0.01:
            interval = scene["time.frame_interval"] * (layer / depth) ** 0.5
            sets += [f"geometry.height={float(depth * d)!r}", f"time.frame_interval={interval:.6g}"]
        out.append(Task(Recipe("dem", tuple(sets)), "", angle, depth))
    for law, card in LAWS.items():
        for angle in ANGLES:
            sets = [f"geometry.inclination={angle}", f"material.law={law}"]
            sets += [f"material.card={card}"] if card else ["material.card="]
            sets += [
                f"time.maximum={float(SHORTER * scene['time.maximum'])!r}",
                "time.frame_interval=2.0",
            ]
            out.append(Task(Recipe("mpm", tuple(sets)), law, angle, layer))
    return [task for task in out if only in ("", task.recipe.engine)]


def result(scene: case.Case, task: Task) -> Path:
    """The run's file, made unless it is there. Raises CaseError with the engine's words."""
    here = case.load(scene.path, task.recipe.sets)
    of_grains = task.recipe.engine == "dem"
    made = ensemble_key(here) if of_grains else [here.resolved, content.of_continuum()]
    path = kept("studies", "chute", f"{content.digest([task.recipe.engine, made])}.h5")
    if path.exists():
        return path
    path.parent.mkdir(parents=True, exist_ok=True)
    print(f"{task.recipe.engine} {task.recipe.label}", file=sys.stderr, flush=True)
    done = subprocess.run(
        task.recipe.words(scene.path, path), capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise CaseError((done.stderr.strip().splitlines() or ["no word"])[-1])
    return path


def row(scene: case.Case, task: Task) -> dict:
    found: dict = {
        "engine": task.recipe.engine,
        "law": task.law,
        "inclination": task.inclination,
        "height": task.height,
    }
    try:
        side = sides.of(result(scene, task))
    except CaseError as error:  # a law that ends badly is a finding, too
        return found | {"failure": str(error)}
    figures = side.flow.figures
    if side.flow.state == "crowded":  # what its points carry is no state of the law
        figures = dict.fromkeys(figures, np.nan) | {"crowding": figures["crowding"]}
    inertial = figures["inertial_number"]
    for fact in published.at(task.inclination, inertial if np.isfinite(inertial) else 0.0):
        found[f"published_{fact.figure}"] = fact.value
    return (
        found
        | {name: figures[name] for name in (*WORDS, "solid_fraction_scatter")}
        | {
            "state": side.flow.state,
            "end_reason": side.run.attributes.get("end_reason", ""),
            "cpu_seconds": side.run.attributes.get("cpu_seconds", np.nan),
        }
    )


def start(scene: case.Case) -> pd.DataFrame:
    """What a settled layer of grains does at each of STARTS."""
    rows = []
    for angle in STARTS:
        sets = (f"geometry.inclination={angle}", f"time.maximum={STARTED}")
        task = Task(Recipe("dem", sets), "", angle, scene["geometry.height"])
        side = sides.of(result(scene, task))
        rows.append(
            {
                "inclination": angle,
                "end_reason": side.run.attributes.get("end_reason", ""),
                "end_time": side.run.tau()[-1],
                "state": side.flow.state,
                "velocity_at_end": float(side.velocity[-5:].mean()),
            }
        )
    return pd.DataFrame(rows)


def exponents(table: pd.DataFrame, inclination: float) -> dict[str, float]:
    """Of the grains' velocity over the depth that they have while they flow: of the mean velocity,
    which the slow layers on the base lower the more the shallower the flow; and of the core, whose
    velocities go as I h^(3/2) where its inertial number is I.
    """
    rows = table[
        (table["engine"] == "dem")
        & (table["inclination"] == inclination)
        & (table["state"] == "steady")
    ]
    if len(rows) < 2:
        return {}
    return {
        "mean velocity": power(rows["depth"], rows["mean_velocity"]),
        "core": 1.5 + power(rows["depth"], rows["inertial_number"]),
    }


def main() -> int:
    parser = command_line.Parser(prog="compare.chute.study", description=__doc__.split("\n")[0])
    parser.add_argument("case", nargs="?", default="chute", metavar="CASE", help="the chute")
    parser.add_argument("-o", "--out", type=Path, metavar="FOLDER", help="of table and figure")
    parser.add_argument("--only", choices=["mpm", "dem"], default="", help="one engine alone")
    parser.add_argument("--start", action="store_true", help="where a settled layer begins to flow")
    options = parser.parse_args()
    scene = case.load(find_case(options.case))
    out = options.out or scene.path.parent / "reference"
    out.mkdir(parents=True, exist_ok=True)
    about = provenance.about(provenance.typed("python3 -m compare.chute.study", sys.argv[1:]))
    if options.start:
        table = start(scene)
        units = "inclination [deg], end_time [sqrt(H/g)], velocity_at_end [m/s], of five frames"
        write_table(out / "start.csv", provenance.head(about, units), table, "%.5g")
        print(table.to_string(index=False))
        return 0
    table = pd.DataFrame([row(scene, task) for task in plan(scene, options.only)])
    table = table.reindex(columns=[name for name in COLUMNS if name in table])
    over = exponents(table, scene["geometry.inclination"])
    notes = [f"{name}: {doc} [{unit}]" for name, (doc, unit) in WORDS.items()]
    notes += [
        f"exponent of the grains' {name} over the depth: {value:.3f} (published: 1.5)"
        for name, value in over.items()
    ]
    write_table(out / "steady.csv", provenance.head(about, *notes), table, "%.5g")
    charts.steady(table, out / "steady")
    print(table.to_string(index=False, float_format=lambda value: f"{value:.4g}"))
    print(*notes[len(WORDS) :], sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(main))
