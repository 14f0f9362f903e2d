"""Long runs of the fuzz targets and of the readers' mutations, and what they counted.

    /usr/bin/python3 -m tests.fuzz.counts case run_file library --build build/fuzz
    /usr/bin/python3 -m tests.fuzz.counts readers

Each run adds its row to tests/data/fuzz/counts.csv, instead of an earlier one of the same name;
what it finds it tells, keeps in --found, and exits with 3.
"""

import argparse
import csv
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from cases.files import replacing
from cases.programs import ROOT
from cases.provenance import commit, machine
from tests.fuzz import readers

DATA = ROOT / "tests/data/fuzz"
TABLE = DATA / "counts.csv"
HEAD = ("name", "executions", "per_cpu_second", "seed", "faults", "commit", "machine")
# Longest input of each target [bytes].
TARGETS = {"case": 1600, "run_file": 48, "library": 4400}
HANG = 60  # [s] by the clock: the targets themselves count their own second of work


def record(row: dict, path: Path = TABLE) -> None:
    """Puts a run's row into the table, in order of names."""
    rows = {}
    if path.exists():
        with path.open(newline="") as file:
            rows = {one["name"]: one for one in csv.DictReader(file)}
    rows[row["name"]] = {name: str(row[name]) for name in HEAD}
    with replacing(path) as target, target.open("w", newline="") as file:
        out = csv.DictWriter(file, HEAD, lineterminator="\n")
        out.writeheader()
        out.writerows(rows[name] for name in sorted(rows))


def fuzzed(name: str, build: Path, runs: int, seed: int, found: Path) -> dict:
    """A run of a C++ target from its kept inputs."""
    found.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        words = [
            build / "tests" / f"{name}_fuzz",
            *(folder, DATA / name),
            *(f"-runs={runs}", f"-seed={seed}", f"-max_len={TARGETS[name]}", "-len_control=0"),
            # Energies by entropy, and leaks at every input that is kept instead of at the end, took
            # a third of a run.
            *("-entropic=0", "-detect_leaks=0"),
            *(f"-timeout={HANG}", "-rss_limit_mb=3000", "-print_final_stats=1", "-verbosity=0"),
            f"-artifact_prefix={found}/{name}-",
        ]
        before = os.times()
        done = subprocess.run(list(map(str, words)), stderr=subprocess.PIPE, text=True, check=False)
        after = os.times()
    count = re.search(r"number_of_executed_units: (\d+)", done.stderr)
    if count is None or done.returncode != 0:
        print(done.stderr[-4000:], file=sys.stderr)
    seconds = after.children_user + after.children_system
    seconds -= before.children_user + before.children_system
    return row_of(
        name, int(count[1]) if count else 0, seconds, seed, faults=int(done.returncode != 0)
    )


def row_of(name: str, executions: int, seconds: float, seed: int, faults: int) -> dict:
    rate = round(executions / max(seconds, 1e-3))
    values = (name, executions, rate, seed, faults, commit(), machine())
    return dict(zip(HEAD, values))


def read(name: str, runs: int, seed: int, found: Path) -> dict:
    """A run of a reader's mutations."""
    begun = time.process_time()
    with tempfile.TemporaryDirectory(dir="/dev/shm") as folder:
        count, faults = readers.hunt(name, runs, seed, Path(folder))
    for number, fault in enumerate(faults):
        place = found / f"{name}-{number}"
        place.mkdir(parents=True, exist_ok=True)
        (place / fault.name).write_bytes(fault.data)
        print(f"{place / fault.name}: {fault.what}", file=sys.stderr)
    return row_of(name, count, time.process_time() - begun, seed, len(faults))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add = parser.add_argument
    add("names", nargs="+", metavar="NAME", help=f"{', '.join(TARGETS)}; or a reader's, or readers")
    add("--build", type=Path, default=ROOT / "build/fuzz", help="where the targets are built")
    add("--runs", type=int, help="default: a million of a target, a hundred thousand of a reader")
    add("--seed", type=int, default=1)
    add("--found", type=Path, default=ROOT / "build/fuzz/found", help="where faults are kept")
    options = parser.parse_args()
    names = []
    for name in options.names:
        names += list(readers.targets()) if name == "readers" else [name]
    faults = 0
    for name in names:
        if name in TARGETS:
            row = fuzzed(name, options.build, options.runs or 10**6, options.seed, options.found)
        else:
            row = read(name, options.runs or 10**5, options.seed, options.found)
        record(row)
        print(", ".join(f"{key} {value}" for key, value in row.items()), flush=True)
        faults += row["faults"]
    return 3 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
