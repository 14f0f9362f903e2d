"""RESULTS.md: what the studies found, drawn from the tables in cases/*/reference and nothing else.

    python3 -m compare.study.results [--check]

With --check nothing is written; the exit code says whether the page is that of the tables.
"""

import json
import math
import re
import sys
from pathlib import Path

import jinja2

from cases import command_line
from cases.errors import CaseError, exit_code
from cases.files import write_atomically
from cases.programs import ROOT
from compare.chute import results as of_chute
from compare.study import frontier, priced, refined
from compare.study.shown import LAWS, markdown, origin, per_cent, read, times

PAGE = ROOT / "RESULTS.md"
MARKS = dict.fromkeys(("agree", "within margin"), "") | {
    "differ": " **differs**",
    "outside margin": " **outside**",
}
OVER = "over their aspect ratio: the continuum, the grains, and laws and points that are published"
SEEN = {  # in the figure of an experiment
    "channel": f"Run-out and height of columns in a channel {OVER}",
    "cylinder": f"Run-out and height of cylinders {OVER}",
    "silo": "Discharge of a silo over the width of its slot: the continuum, the grains, and "
    "Beverloo's law",
}


def ladders(names: list[str]) -> str:
    """What was enough in each scene."""
    rows = []
    for name in names:
        folder = ROOT / "cases" / name / "reference"
        rungs = read(folder / "ladder" / "ladder.csv")
        grains = frontier.grain_cost(json.loads((folder / "grains.json").read_text()))
        head = (folder / "ladder" / "ladder.csv").read_text()
        tolerance = float(re.search(r"; tolerance ([\d.]+)\.", head)[1])  # type: ignore[index]
        enough = rungs[rungs["enough"]]
        told = rungs[rungs["error"].notna()]
        nearest = told.loc[told["error"].idxmin()]
        found = enough.iloc[0] if len(enough) else nearest
        rows.append(
            [
                f"`{name}`, {per_cent(tolerance, 0)}",
                (found["rung"] if len(enough) else f"nothing; nearest {found['rung']}"),
                f"{per_cent(found['error'])} ± {per_cent(found['half_width'])}",
                times(found["cost"], grains),
                str(len(rungs)),
            ]
        )
    return markdown(["scene, deposit within", "enough", "error", "× cheaper", "rungs tried"], rows)


def atlas(name: str) -> str:
    """How far each plane is stable, beside the claimed limit."""
    rows = []
    table = read(ROOT / "cases" / name / "reference" / "atlas" / "boundaries.csv")
    for plane, runs in table.groupby("plane", sort=False):
        each = runs.drop_duplicates("across_value")
        low, high = each["stable_to"].min(), each["stable_to"].max()
        lost = int(each["stable_to"].isna().sum())
        nowhere = f", {lost} of {len(each)} rows nowhere" if lost else ""
        fails = sorted(set(runs["status"]) - {"ok"})
        rows.append(
            [
                str(plane),
                runs["across"].iloc[0].split(".")[-1].replace("_", " ")
                + f" {each['across_value'].min():g}–{each['across_value'].max():g}",
                "unstable throughout" if math.isnan(high) else f"{low:.2g}–{high:.2g}{nowhere}",
                f"{each['times_limit'].min():.2g}",
                f"{each['times_default'].min():.2g}",
                ", ".join(fails) or "no failure found",
            ]
        )
    head = ["method", "across", "stable to", "× claimed limit", "× default", "beyond it"]
    return markdown(head, rows)


def atlas_in_words(name: str) -> str:
    """What the picture of the planes shows."""
    table = read(ROOT / "cases" / name / "reference" / "atlas" / "boundaries.csv")
    least = table.groupby("plane", sort=False)["times_limit"].min()
    beyond = least[least >= 1.0]
    return (
        f"{len(least)} panels, each with the runs of a method by the step they take. In "
        f"{len(beyond)} of them all good runs' boundary lies to the right of the limit that is "
        f"claimed, by a factor of {beyond.min():.2g} at least; to the right of it runs drift, grow "
        "in energy or lose points"
    )


def failures(name: str) -> str:
    table = read(ROOT / "cases" / name / "reference" / "atlas" / "failures.csv")
    return markdown(
        ["failure", "what the solver says", "shown", "absent at the defaults"],
        [
            [
                row["failure"],
                row["expected"],
                "yes" if row["reproduced"] else "no",
                "yes" if row["absent_at_defaults"] else "no",
            ]
            for _, row in table.iterrows()
        ],
    )


def convergence(name: str, figures: tuple[str, ...]) -> str:
    """Change of each figure for each change of the numerics, with its limit's verdict."""
    table = read(ROOT / "cases" / name / "reference" / "convergence.csv")
    figures = tuple(one for one in figures if (table["figure"] == one).any())
    rows = []
    for (group, setting), found in table.groupby(["group", "setting"], sort=False):
        by = found.set_index("figure")

        def cell(figure: str) -> str:
            one = by.loc[figure]
            if setting == "as it is" or math.isnan(one["change"]):
                return f"{one['mean']:.3f}"
            mark = MARKS.get(one["verdict"], " unresolved")
            return f"{100.0 * one['change']:+.1f} %{mark}"

        start = f"**{group}**" if setting == "as it is" else str(setting)
        steps = f"{by.loc['steps', 'mean']:.0f}"
        rows.append(
            [start, *(cell(one) for one in figures), per_cent(by.loc["loss", "mean"]), steps]
        )
    names = [one.replace("_", " ") for one in figures]
    return markdown(["setting", *names, "lost", "steps"], rows)


def verdicts(names: list[str]) -> list[dict]:
    out = []
    for name in names:
        path = ROOT / "cases" / name / "reference" / "verdicts.csv"
        table = read(path)
        rows = [
            [
                f"`{row['metric']}` [{row['unit']}]",
                f"{row['continuum']:.3f}"
                + (
                    ""
                    if math.isnan(row["numerical_uncertainty"])
                    else f" ± {row['numerical_uncertainty']:.3f}"
                ),
                "–"
                if math.isnan(row["grains"])
                else f"{row['grains']:.3f} ± {row['grains_deviation']:.3f}",
                f"{row['difference']:+.3f} ± {row['half_width']:.3f}",
                f"{row['margin']:.3f}",
                row["verdict"],
            ]
            for _, row in table.iterrows()
        ]
        head = [
            "figure",
            "continuum ± numerics",
            "grains ± packings",
            "difference",
            "margin",
            "verdict",
        ]
        out.append({"name": name, "origin": origin(path), "table": markdown(head, rows)})
    return out


def experiment(name: str) -> str:
    """Each figure of both engines for each aspect ratio, or slot, beside what is published."""
    table = read(ROOT / "cases" / name / "reference" / "experiment.csv")
    rows, place = [], table.columns[0]
    for _, row in table.iterrows():
        pairs = (("mpm", "numerical"), ("dem", "deviation"))
        ours = (f"{row[mean]:.2f} ± {row[bar]:.2f}" for mean, bar in pairs)
        least, most = row["published_least"], row["published_most"]
        known = "–" if math.isnan(least) else f"{least:.2f} to {most:.2f}"
        figure = row["figure"].replace("_", "-")
        rows.append([f"{row[place]:g}", figure, *ours, row["verdict"], known])
    of = ("slot [d]", "figure") if place == "slot" else ("a", "figure [L0]")
    head = [*of, "continuum ± numerics", "grains ± packings", "verdict", "published"]
    return markdown(head, rows)


def outcome(name: str) -> str:
    """Bias of each law in the grains' flow beside what its collapse is off by."""
    table = read(ROOT / "cases" / name / "reference" / "judge" / "outcome.csv")
    figures = ("run_out_95", "final_height", "centre_of_mass_x")
    errors = ("deposit", "kinetic", "dissipation", "temperature")
    rows = [
        [
            f"`{row['scene']}`",
            row["law"].replace("_", " "),
            f"{100.0 * row['bias']:+.0f} %",
            *(f"{100.0 * row[one]:+.1f} %" for one in figures),
            *(per_cent(row[f"error_{one}"]) for one in errors),
        ]
        for _, row in table.iterrows()
    ]
    names = ["run-out", "height", "centre of mass", *errors]
    return markdown(["scene", "law", "bias of μ_D", *names], rows)


def statements(name: str) -> str:
    table = read(ROOT / "cases" / name / "reference" / "statements.csv")
    return markdown(
        ["statement of the seed", "measured", "bound", "verdict"],
        [
            [
                row["statement"].replace("_", " "),
                f"{row['figure']:.3g} {row['unit']}",
                row["bound"],
                row["verdict"],
            ]
            for _, row in table.iterrows()
        ],
    )


def page() -> str:
    """The whole page."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    reference = {
        name: ROOT / "cases" / name / "reference"
        for name in ("column", "column_small", "column_ci", "column_full", *SEEN)
    }
    return environment.get_template("results.md.j2").render(
        frontiers=[priced.values("column_small"), priced.values("column")],
        ladders=ladders(["column_shallow", "column", "column_small", "column_tall"]),
        atlas=atlas("column_ci"),
        atlas_seen=atlas_in_words("column_ci"),
        atlas_origin=origin(reference["column_ci"] / "atlas" / "boundaries.csv"),
        failures=failures("column_ci"),
        convergence={
            "column": convergence("column", ("run_out_95", "centre", "height", "peak")),
            "column_small": convergence("column_small", ("run_out_95", "centre", "height", "peak")),
        },
        convergence_origin={
            name: origin(reference[name] / "convergence.csv") for name in ("column", "column_small")
        },
        refined=refined.values(ROOT / "cases" / "column_small" / "reference", LAWS),
        verdicts=verdicts(["column_small", "column", "column_ci"]),
        experiments=[
            {
                "name": name,
                "seen": words,
                "origin": origin(reference[name] / "experiment.csv"),
                "table": experiment(name),
            }
            for name, words in SEEN.items()
        ],
        chute=of_chute.values(),
        outcome=outcome("column_small"),
        outcome_origin=origin(reference["column_small"] / "judge" / "outcome.csv"),
        statements=statements("column_full"),
        statements_origin=origin(reference["column_full"] / "statements.csv"),
    )


def main() -> int:
    parser = command_line.Parser(
        prog="compare.study.results", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument(
        "--check", action="store_true", help="write nothing; say whether it is up to date"
    )
    options = parser.parse_args()
    text = page()
    if options.check:
        if PAGE.read_text() != text:
            raise CaseError(
                f"{PAGE.name}: not what the tables say. Write it anew: "
                "python3 -m compare.study.results"
            )
        return 0
    write_atomically(PAGE, text)
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(main))
