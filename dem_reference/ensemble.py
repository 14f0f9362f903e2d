"""Many seeds of one case: their scatter is the noise floor of every comparison.

    python3 -m dem_reference.ensemble CASE [--seeds N] [--first N] [--set key=value]... [--jobs N]
        [--ranks N] [--profile DIR] [--name NAME] [--table FILE] [--dry-run]

Snakemake runs the seeds, two at a time unless told otherwise, takes up again where it was stopped,
and on a cluster hands each seed to the scheduler (`--profile dem_reference/slurm`). Runs are kept
in runs/ensembles/<case>/<key>, where the key is of what decides the grains
(dem_reference/content.py): asked again, by whatever name, they are there, and of another friction
they are others. The table goes to cases/<case>/reference/<name>.csv unless told otherwise.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd
from scipy import stats

from cases import command_line, cores, workflow
from cases.case import Case, load
from cases.errors import CaseError, EngineError
from cases.files import check_table, write_table
from cases.programs import short
from cases.provenance import about, head

from . import content
from .summary import SCALARS, scalars

UNITS = "units: " + ", ".join(f"{name} [{unit}]" for name, unit in SCALARS.items())


def save(table: pd.DataFrame, target: Path, command: str, *notes: str) -> None:
    """A table as CSV below comment lines that say where it comes from and what it holds."""
    write_table(target, head(about(command), *notes), table, "%.6g")


def tabulate(case: Case, runs: list[Path], target: Path, command: str) -> None:
    """The scalars of the runs as CSV; its head also states the inputs that they were made from."""
    table = pd.DataFrame([scalars(run) for run in runs]).sort_values("seed")
    made_of = json.dumps(content.inputs(case), sort_keys=True)
    save(table, target, command, f"made of: {made_of}", UNITS)


def scatter(target: Path) -> str:
    """Mean and 95 % interval (Student's t) of each scalar, one line each."""
    table = pd.read_csv(target, comment="#")
    n = len(table)
    half = (
        stats.t.ppf(0.975, n - 1) * table.std(ddof=1) / np.sqrt(n)
        if n > 1
        else table.mean() * np.nan
    )
    return "\n".join(
        f"{name:26} {table[name].mean():10.4g} +- {half[name]:8.2g} "
        f"(s {table[name].std(ddof=1):.2g}) {SCALARS[name]}"
        for name in table
        if name != "seed"
    )


def make(
    case: Case, sets: list[str], seeds: range, where: workflow.Where, *, ranks=1, dry=False
) -> list[Path]:
    """Runs the seeds that are missing; returns the file of each. `sets` are the assignments that
    `case` was loaded with.
    """
    folder = content.ensemble_folder(case, ranks)
    path = case.path.parent if case.path.name == "case.toml" else case.path
    config = {"case": str(short(path)), "set": sets, "ranks": ranks, "seeds": list(seeds)}
    snakefile = Path(__file__).with_name("Snakefile")
    workflow.run(snakefile, folder, config, where, dry=dry, alone=not dry)
    return [folder / f"{seed}.h5" for seed in seeds]


def parser() -> command_line.Parser:
    out = command_line.Parser(prog="dem_reference.ensemble", description=__doc__.split("\n")[0])
    out.add_argument("case", metavar="CASE")
    out.add_argument("--seeds", type=command_line.several, default=5, help="how many (default 5)")
    out.add_argument(
        "--first", type=command_line.seed, default=1, help="the first seed (default 1)"
    )
    out.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    out.add_argument(
        "--jobs",
        type=command_line.threads,
        help="seeds at a time (as many as there are cores and memory for)",
    )
    out.add_argument("--ranks", type=command_line.threads, default=1, help="MPI ranks of each")
    out.add_argument(
        "--profile", type=Path, help="a Snakemake profile, such as dem_reference/slurm"
    )
    out.add_argument("--dry-run", action="store_true", help="only show which seeds would run")
    out.add_argument("--name", default="ensemble", help="name of the table (default ensemble)")
    out.add_argument(
        "--table", type=Path, help="file of the table (cases/<case>/reference/<name>.csv)"
    )
    return out


def main() -> int:
    options = parser().parse_args()
    seeds = range(options.first, options.first + options.seeds)
    jobs = options.jobs or max(1, cores.jobs() // options.ranks)
    where = workflow.Where(jobs * options.ranks, options.profile)
    try:
        if seeds[-1] > command_line.MOST_SEED:
            raise CaseError(
                f"--first {options.first}: no {options.seeds} seeds follow (the last is "
                f"{command_line.MOST_SEED})"
            )
        case = load(options.case, options.set)
        folder = case.path.parent if case.path.name == "case.toml" else case.path.with_suffix("")
        table = options.table or folder / "reference" / f"{options.name}.csv"
        if not options.dry_run:
            check_table(table)
        runs = make(case, options.set, seeds, where, ranks=options.ranks, dry=options.dry_run)
        if options.dry_run:
            return 0
        tabulate(case, runs, table, " ".join(["python3 -m dem_reference.ensemble", *sys.argv[1:]]))
    except CaseError as error:
        print(error, file=sys.stderr)
        return 2
    except EngineError as error:
        print(f"ensemble: {error}", file=sys.stderr)
        return 3
    print(scatter(table))
    return 0


if __name__ == "__main__":
    sys.exit(main())
