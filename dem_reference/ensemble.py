"""Many seeds of one case: their scatter is the noise floor of every comparison.

    python3 -m dem_reference.ensemble CASE [--seeds N] [--first N] [--set key=value]... [--jobs N] [--ranks N] [--profile DIR]
                                      [--name NAME] [--table FILE] [--dry-run]

Snakemake runs the seeds, two at a time unless told otherwise, takes up again where it was stopped, and on a cluster
hands each seed to the scheduler (`--profile dem_reference/slurm`). The table goes to cases/<case>/reference/<name>.csv
unless told otherwise.
"""

import argparse
import datetime
import json
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
from scipy import stats

from cases import files
from cases.case import load
from cases.errors import CaseError, EngineError

from .output import commit
from .summary import SCALARS, scalars

ROOT = Path(__file__).resolve().parents[1]


def write_table(runs: list[Path], target: Path, command: str) -> None:
    """The scalars of the runs as CSV."""
    table = pd.DataFrame([scalars(run) for run in runs]).sort_values("seed")
    save(
        table,
        target,
        command,
        "units: " + ", ".join(f"{name} [{unit}]" for name, unit in SCALARS.items()),
    )


def save(table: pd.DataFrame, target: Path, command: str, note: str) -> None:
    """A table as CSV below comment lines that say where it comes from; appears complete or not at all."""
    today = datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d")
    header = [
        f"command: {command}",
        f"commit: {commit()}  date: {today}  machine: {platform.machine()}, {processor()}",
        note,
    ]
    files.write_table(target, header, table, "%.6g")


def processor() -> str:
    """Name of the processor, as Linux tells it."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    return next(
        (line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")),
        platform.machine(),
    )


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
        f"{name:26} {table[name].mean():10.4g} +- {half[name]:8.2g} (s {table[name].std(ddof=1):.2g}) {SCALARS[name]}"
        for name in table
        if name != "seed"
    )


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="dem_reference.ensemble", description=__doc__.split("\n")[0]
    )
    parser.add_argument("case", metavar="CASE")
    parser.add_argument("--seeds", type=int, default=5, help="how many (default 5)")
    parser.add_argument("--first", type=int, default=1, help="the first seed (default 1)")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--jobs", type=int, default=2, help="seeds at a time (default 2)")
    parser.add_argument("--ranks", type=int, default=1, help="MPI ranks of each")
    parser.add_argument("--profile", help="a Snakemake profile, such as dem_reference/slurm")
    parser.add_argument("--dry-run", action="store_true", help="only show which seeds would run")
    parser.add_argument(
        "--name",
        default="ensemble",
        help="name of the table and of the runs' folder (default ensemble)",
    )
    parser.add_argument(
        "--table", type=Path, help="file of the table (cases/<case>/reference/<name>.csv)"
    )
    options = parser.parse_args()
    try:
        case = load(options.case, options.set)
    except (CaseError, EngineError) as error:
        print(error, file=sys.stderr)
        return 2
    folder = case.path.parent if case.path.name == "case.toml" else case.path.with_suffix("")
    config = {
        "case": str(case.path.resolve()),
        "set": options.set,
        "ranks": options.ranks,
        "name": options.name,
        "seeds": list(range(options.first, options.first + options.seeds)),
        "folder": folder.name,
        "table": str((options.table or folder / "reference" / f"{options.name}.csv").resolve()),
        "command": " ".join(["python3 -m dem_reference.ensemble", *sys.argv[1:]]),
    }
    work = ROOT / "runs" / "ensembles" / folder.name / options.name
    work.mkdir(parents=True, exist_ok=True)
    (work / "config.json").write_text(json.dumps(config, indent=1))
    words = [
        "snakemake",
        "-s",
        Path(__file__).with_name("Snakefile"),
        "--configfile",
        work / "config.json",
        "--directory",
        work,
        "--rerun-incomplete",
        "--rerun-triggers",
        "mtime",
        "--keep-going",
    ]
    words += ["--dry-run"] if options.dry_run else ["--quiet", "all"]
    words += (
        ["--profile", Path(options.profile).resolve()]
        if options.profile
        else ["--cores", str(options.jobs * options.ranks)]
    )
    done = subprocess.run([str(word) for word in words], cwd=ROOT, check=False)
    if done.returncode:
        print(
            f"ensemble: not every seed came through (see {work}) run it again to take up the rest",
            file=sys.stderr,
        )
        return 3
    if options.dry_run:
        return 0
    print(scatter(Path(config["table"])))
    return 0


if __name__ == "__main__":
    sys.exit(main())
