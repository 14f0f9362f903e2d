"""The metrics of an ensemble's packings, one row each, for the scatter that verdicts on a single
pair take (compare/verdict/packings.py).

    python3 -m compare.study.packings CASE [--seeds N] [--jobs N] [--signatures]

Makes the runs of the grains that are missing, maps them and writes
cases/<case>/reference/ensemble_metrics.csv. With --signatures from reference/grains.json instead,
without a run: those metrics only that a signature holds.
"""

import argparse
import json
import sys
from pathlib import Path

from cases import workflow
from cases.case import Case, load
from cases.errors import exit_code
from cases.files import write_table
from cases.provenance import about, head, typed
from cases.scratch import temporary
from compare.mapping.runs import Run, map_fields, open_fields, open_run
from compare.metrics import Metric, all_metrics
from compare.study import reference
from compare.study.signature import expand
from compare.verdict.comparison import pair
from compare.verdict.packings import MADE_OF, TABLE
from dem_reference import ensemble
from dem_reference.content import inputs

# Kept beside those that get a verdict: other ways to say how far and how high.
BESIDE = ("run_out_99", "run_out_height", "run_out_connected", "centre_of_mass_y")
# What a signature (compare/study/signature.py) tells as a run does; of 512 levels of mass the one
# above 95 % is 95.1 %.
SIGNED = (
    "run_out",
    "run_out_99",
    "run_out_95",
    "centre_of_mass_x",
    "kinetic_energy_peak",
    "kinetic_energy_peak_time",
    "dissipated_energy",
)


def columns() -> list[Metric]:
    """The metrics of a run that a table holds."""
    known = all_metrics()
    return [
        known[name]
        for name in sorted(known)
        if not known[name].of_pair and (known[name].margin or name in BESIDE)
    ]


def row(run: Run, metrics: list[Metric]) -> dict:
    """Metrics of one packing, its energies in what it releases itself, as in a pair with it."""
    pair([], [run])
    return {"seed": run.attributes["seed"]} | {one.name: one(run) for one in metrics}


def of_runs(files: list[Path]) -> list[dict]:
    """Rows of the runs <seed>.h5."""
    with temporary() as scratch:
        fields = scratch / "fields.h5"
        map_fields(files, fields)
        runs = [open_run(path) for path in files]
        for run in runs:
            run.mapped = open_fields(fields, run.name)
        return [row(run, columns()) for run in runs]


def of_signatures(path: Path, scene: Case) -> list[dict]:
    """Rows of the members of a reference of the grains."""
    members = reference.read(path, scene)["members"]
    chosen = [one for one in columns() if one.name in SIGNED]
    return [row(expand(member, scene), chosen) for member in members]


def write(rows: list[dict], made_of: dict, path: Path, command: str):
    units = ", ".join(f"{one.name} [{one.unit}]" for one in columns() if one.name in rows[0])
    notes = (MADE_OF.removeprefix("# ") + json.dumps(made_of, sort_keys=True), f"units: {units}")
    write_table(path, head(about(command), *notes), rows, "%.5g")


def main(words: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="compare.study.packings", description=__doc__)
    parser.add_argument("case", type=Path, metavar="CASE", help="folder that holds case.toml")
    parser.add_argument("--seeds", type=int, default=8, help="how many packings (%(default)s)")
    parser.add_argument("--jobs", type=int, default=1, help="seeds at a time (%(default)s)")
    parser.add_argument(
        "--signatures", action="store_true", help="of reference/grains.json, without a run"
    )
    options = parser.parse_args(words)
    scene = load(options.case)
    folder = scene.path.parent
    if options.signatures:
        rows = of_signatures(folder / "reference" / "grains.json", scene)
    else:
        seeds = range(1, options.seeds + 1)
        rows = of_runs(ensemble.make(scene, [], seeds, workflow.Where(options.jobs, None)))
    command = typed("python3 -m compare.study.packings", words)
    write(rows, inputs(scene), folder / TABLE, command)
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(sys.argv[1:])))
