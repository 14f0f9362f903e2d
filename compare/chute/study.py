"""Flows down a plane of several inclinations and depths, of the grains and of every law.

    python3 -m compare.chute.study [CASE] [-o FOLDER] [--only mpm|dem] [--seeds N] [--start]

Runs that are there are kept (runs/studies/chute). Written to FOLDER, by default cases/<case>/
reference: steady.csv, with a row for each flow, and steady.png; with --start start.csv and
start.png instead: at which inclinations a settled layer begins to flow, and a flowing one stops.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd

from cases import case, command_line, provenance
from cases.errors import CaseError, exit_code
from cases.files import write_table
from cases.lookup import find_case
from compare.chute import charts, plan, published, sides, thresholds
from compare.chute.flow import power
from compare.chute.plan import Task
from compare.chute.words import STATE, WORDS

WORST = ("normal_balance", "shear_balance")  # of several packings the worst
SCATTERED = STATE  # over several packings
COLUMNS = (
    "engine",
    "law",
    "inclination",
    "height",
    "end_reason",
    "state",
    *WORDS,
    "solid_fraction_scatter",
    "packings",
    *(f"{name}_deviation" for name in SCATTERED),
    "published_solid_fraction",
    "published_inertial_number",
    "cpu_seconds",
    "failure",
)


def row(scene: case.Case, task: Task) -> dict:
    found: dict = {
        "engine": task.recipe.engine,
        "law": task.law,
        "inclination": task.inclination,
        "height": task.height,
    }
    try:
        side = sides.of(plan.result(scene, task))
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


def over_packings(rows: list[dict]) -> dict:
    """One row of those of several packings: means, of balances the worst, and standard deviations
    of SCATTERED; the state, where all have the same.
    """
    if len(rows) == 1:
        return rows[0] | {"packings": 1}
    frame = pd.DataFrame(rows)
    numbers = frame.select_dtypes("number")
    found = rows[0] | numbers.mean().to_dict() | numbers[list(WORST)].max().to_dict()
    found |= {f"{name}_deviation": float(frame[name].std(ddof=1)) for name in SCATTERED}
    states = sorted(set(frame["state"]))
    return found | {"state": " or ".join(states), "packings": len(rows)}


def steady(scene: case.Case, tasks: list[Task]) -> pd.DataFrame:
    """A row for each flow, over its packings."""
    groups: dict[tuple, list[dict]] = {}
    for task in tasks:
        key = (task.recipe.engine, task.law, task.inclination, task.height)
        groups.setdefault(key, []).append(row(scene, task))
    table = pd.DataFrame([over_packings(rows) for rows in groups.values()])
    return table.reindex(columns=[name for name in COLUMNS if name in table])


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
    parser.add_argument(
        "--seeds",
        type=command_line.several,
        default=plan.SEEDS,
        metavar="N",
        help="packings of the grains at the case's inclination and depth (%(default)s)",
    )
    parser.add_argument(
        "--start", action="store_true", help="where a layer begins to flow, and where it stops"
    )
    options = parser.parse_args()
    scene = case.load(find_case(options.case))
    out = options.out or scene.path.parent / "reference"
    out.mkdir(parents=True, exist_ok=True)
    about = provenance.about(provenance.typed("python3 -m compare.chute.study", sys.argv[1:]))
    return started(scene, out, about) if options.start else flows(scene, options, out, about)


def started(scene: case.Case, out: Path, about: dict) -> int:
    """start.csv and start.png."""
    table = thresholds.table(scene)
    notes = [thresholds.UNITS]
    for engine in ("dem", "mpm"):
        for name, (stands, goes) in thresholds.angles(table, engine).items():
            notes.append(f"{engine}: {name} between {stands:g} and {goes:g} deg")
    write_table(out / "start.csv", provenance.head(about, *notes), table, "%.5g")
    charts.thresholds(table, scene, out / "start")
    print(table.to_string(index=False))
    print(*notes[1:], sep="\n")
    return 0


def flows(scene: case.Case, options, out: Path, about: dict) -> int:
    """steady.csv and steady.png."""
    table = steady(scene, plan.steady(scene, options.only, options.seeds))
    over = exponents(table, scene["geometry.inclination"])
    notes = [f"{name}: {doc} [{unit}]" for name, (doc, unit) in WORDS.items()]
    notes += [
        "means over the packings, of balances the worst; deviation: standard deviation over them",
        *(
            f"exponent of the grains' {name} over the depth: {value:.3f} (published: 1.5)"
            for name, value in over.items()
        ),
    ]
    write_table(out / "steady.csv", provenance.head(about, *notes), table, "%.5g")
    charts.steady(table, out / "steady")
    print(table.to_string(index=False, float_format=lambda value: f"{value:.4g}"))
    print(*notes[len(WORDS) :], sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(main))
