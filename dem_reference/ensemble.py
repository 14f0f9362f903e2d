"""Many seeds of one case: their scatter is the noise floor of every comparison.

    python3 -m dem_reference.ensemble CASE [--seeds N] [--first N] [--set key=value]... [--jobs N]
        [--ranks N] [--profile DIR] [--name NAME] [--table FILE] [--dry-run] [--quiet | --progress]

Seeds run beside each other as far as there are cores and memory, and what was stopped is taken up
again; on a cluster Snakemake hands each seed to the scheduler (`--profile cases/slurm`).
Runs are kept in runs/ensembles/<case>/<key>, where the key is of what decides the grains
(dem_reference/content.py): asked again, by whatever name, they are there, and of another friction
they are others. The table goes to cases/<case>/reference/<name>.csv unless told otherwise; a chute
has none, whose flow compare/chute measures.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from cases import command_line, cores, student, workflow
from cases.case import Case, load
from cases.errors import CaseError, EngineError
from cases.files import check_table, write_table
from cases.jobs import Job
from cases.members import Members
from cases.programs import short
from cases.provenance import about, head, typed
from cases.scenes import is_chute

from . import content, cost, packing
from .ranks import refuse_without_mpi
from .summary import OWN, SCALARS, scalars

RUN = "dem_reference.run"  # the module that makes one
UNITS = "units: " + ", ".join(f"{name} [{unit}]" for name, unit in (SCALARS | OWN).items())


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
        student.quantile(0.975, n - 1) * table.std(ddof=1) / np.sqrt(n)
        if n > 1
        else table.mean() * np.nan
    )
    return "\n".join(
        f"{name:26} {table[name].mean():10.4g} +- {half[name]:8.2g} "
        f"(s {table[name].std(ddof=1):.2g}) {(SCALARS | OWN)[name]}"
        for name in table
        if name != "seed"
    )


def make(
    case: Case,
    sets: list[str],
    seeds: range,
    where: workflow.Where,
    *,
    ranks: int = 1,
    dry: bool = False,
    quiet: bool = False,
    progress: bool = False,
) -> list[Path]:
    """Runs the seeds that are missing, and shows how far they are unless that is to be `quiet`, or
    said as `progress` lines; returns the file of each. `sets` are the assignments that `case` was
    loaded with.
    """
    folder = content.ensemble_folder(case, ranks)
    path = case.path.parent if case.path.name == "case.toml" else case.path
    files = {str(seed): folder / f"{seed}.h5" for seed in seeds}
    common = [str(short(path)), *(word for one in sets for word in ("--set", one))]
    common += ["--ranks", str(ranks), "--quiet"]
    seconds, memory = takes(case)
    memory += (ranks - 1) * cores.RANK_BYTES * (memory > 0.0)
    jobs = {
        seed: Job(
            file, (RUN, *common, "-o", str(short(file)), "--seed", seed), ranks, seconds, memory
        )
        for seed, file in files.items()
    }
    members = Members(
        "seeds of the grains",
        files,
        {name: f"seed {name}" for name in files},
        {name: seconds / ranks for name in files if seconds},
        quiet,
        progress,
    )
    workflow.run(jobs, folder, where, members, dry=dry, alone=not dry)
    return list(files.values())


def takes(case: Case) -> tuple[float, float]:
    """Processor time [s] and memory [bytes] of each seed, as estimated; zeros where the grains
    refuse the case.
    """
    try:
        one = cost.estimate(packing.dict_of(case))
    except CaseError:
        return 0.0, 0.0
    return one.seconds, one.bytes


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
        "--profile",
        type=Path,
        help="a Snakemake profile, such as cases/slurm: the seeds go to a cluster",
    )
    out.add_argument("--dry-run", action="store_true", help="only show which seeds would run")
    out.add_argument("--quiet", action="store_true", help="show no progress")
    out.add_argument(
        "--progress", action="store_true", help="print `progress <fraction> <text>` lines alone"
    )
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
        if options.ranks > 1 and not options.profile:
            refuse_without_mpi()
        case = load(options.case, options.set)
        tabulated = not is_chute(case["geometry"])  # by figures of collapses
        folder = case.path.parent if case.path.name == "case.toml" else case.path.with_suffix("")
        table = options.table or folder / "reference" / f"{options.name}.csv"
        if tabulated and not options.dry_run:
            check_table(table)
        runs = make(
            case,
            options.set,
            seeds,
            where,
            ranks=options.ranks,
            dry=options.dry_run,
            quiet=options.quiet,
            progress=options.progress,
        )
        if options.dry_run:
            return 0
        if tabulated:
            tabulate(case, runs, table, typed("python3 -m dem_reference.ensemble", sys.argv[1:]))
    except CaseError as error:
        print(error, file=sys.stderr)
        return 2
    except EngineError as error:
        print(f"ensemble: {error}", file=sys.stderr)
        return 3
    told = scatter(table) if tabulated else "\n".join(map(str, runs))
    print("progress 1 done" if options.progress else told)
    return 0


if __name__ == "__main__":
    sys.exit(main())
