"""Which figures deserve the headline: what they scatter by between packings, against what they tell
of the law.

    python3 -m compare.study.headlines CASE [--change 0.1]

For each candidate the standard deviation over the case's packings (reference/ensemble_metrics.csv,
compare/study/packings.py) beside its change when the continuum's friction changes by a tenth: half
of the difference between the runs with a tenth more and a tenth less. A figure whose change is less
than its scatter tells one packing from another, not one law from another. Written to
cases/<case>/reference/headlines.csv.
"""

import argparse
import sys
from pathlib import Path

import pandas as pd

from cases.case import Case, load
from cases.errors import EngineError, exit_code
from cases.files import write_table
from cases.programs import call, program
from cases.provenance import about, head, typed
from cases.scratch import temporary
from compare.mapping.runs import Run, map_fields, open_fields, open_run
from compare.metrics import all_metrics
from compare.verdict.comparison import pair
from compare.verdict.packings import TABLE

FRICTION = ("stress_ratio", "static_friction", "dynamic_friction")
CANDIDATES = (
    "run_out",
    "run_out_99",
    "run_out_95",
    "run_out_height",
    "run_out_connected",
    "centre_of_mass_x",
    "centre_of_mass_y",
    "final_height",
)


def continuum(scene: Case, factors: list[float]) -> list[Run]:
    """Runs of the continuum with the law's friction times each factor, mapped."""
    with temporary() as scratch:
        files = []
        for number, factor in enumerate(factors):
            files.append(scratch / f"mpm_{number}.h5")
            command = [program("mpm_run"), scene.path, "-o", files[-1]]
            for key in FRICTION:
                command += ["--set", f"material.{key}={factor * scene[f'material.{key}']}"]
            done = call(command)
            if done.returncode:
                raise EngineError(done.stderr.strip())
        map_fields(files, scratch / "fields.h5")
        runs = [open_run(path) for path in files]
        for run in runs:
            run.mapped = open_fields(scratch / "fields.h5", run.name)
            run.clouds = [run.clouds[-1]]
            for name in ("solid_fraction", "density"):
                run.fields[name]
            pair([run], [run])
    return runs


def change(scene: Case, share: float, names=CANDIDATES) -> dict[str, float]:
    """By how much each figure changes when friction changes by `share`."""
    more, less = continuum(scene, [1.0 + share, 1.0 - share])
    return {name: abs(all_metrics()[name](more) - all_metrics()[name](less)) / 2 for name in names}


def table(scene: Case, share: float) -> list[dict]:
    packings = pd.read_csv(scene.path.parent / TABLE, comment="#")
    changes = change(scene, share)
    return [
        {
            "metric": name,
            "unit": all_metrics()[name].unit,
            "mean": packings[name].mean(),
            "scatter": packings[name].std(ddof=1),
            "change": changes[name],
            "change_over_scatter": changes[name] / packings[name].std(ddof=1),
        }
        for name in CANDIDATES
    ]


def main(words: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="compare.study.headlines", description=__doc__)
    parser.add_argument("case", type=Path, metavar="CASE", help="folder that holds case.toml")
    parser.add_argument(
        "--change", type=float, default=0.1, help="of the friction, up and down (%(default)s)"
    )
    options = parser.parse_args(words)
    scene = load(options.case)
    rows = table(scene, options.change)
    note = f"change: of the continuum, {100 * options.change:g} % of friction; scatter: standard "
    command = typed("python3 -m compare.study.headlines", words)
    notes = (note + f"deviation of the packings of {TABLE.name}",)
    path = scene.path.parent / "reference" / "headlines.csv"
    write_table(path, head(about(command), *notes), rows, "%.3g")
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(sys.argv[1:])))
