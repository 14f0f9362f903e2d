"""What a run of the grains spends its processor time on, several times over and interleaved.

    python3 -m dem_reference.timing CASE [--repeats N] [--before CLONE] [--lammps] [-o TABLE.csv]

Bare is the engine alone: the same steps from the same release in one go, nothing looked at. With
--before the same run by another clone, in what its files tell of it. With --lammps the same steps
in LAMMPS, once with the same contact law and once with its `gran/hertz/history`, whose damping is
another (second_opinion.py): the time of its loop.
"""

import os
import re
import sys
import time
from collections import defaultdict
from pathlib import Path

import pandas as pd

from cases import command_line, cores, reading
from cases.case import Case, load
from cases.errors import EngineError, exit_code
from cases.files import check_table
from cases.programs import PYTHON, call, kept, module
from cases.provenance import typed
from cases.scratch import temporary

from . import packing, second_opinion
from .collapse import Column
from .ensemble import save
from .process import Report, run_engine

Rows = dict[tuple[str, str], list[float]]  # seconds of each repeat, by run and part
LOOP = re.compile(r"^Loop time of ([\d.e+-]+) on 1 procs.*\n(?:.*\n)*?([\d.]+)% CPU use", re.M)


def bare(case: dict, settled: Path, steps: int, log: Path, report: Report) -> float:
    """Processor time of the engine's steps from the release, in one go and unlooked at [s]."""
    column = Column(case, settled, log)
    start = time.process_time()
    column.engine.advance(steps)
    return time.process_time() - start


def grains(start: list, case: Path, sets: list[str], result: Path) -> dict:
    """The attributes of a run of the command that begins with the words `start`."""
    words = [word for one in sets for word in ("--set", one)]
    done = call([*start, case, *words, "-o", result, "--quiet"])
    if done.returncode:
        raise EngineError(done.stderr.strip())
    with reading.result(result) as file:
        return reading.attributes(file)


def parts(told: dict) -> dict[str, float]:
    """Seconds of processor time of a run without its packing, and of its parts, where it tells
    them.
    """
    found = {"collapse": float(told["cpu_seconds_collapse"])}
    for name in ("engine", "audit", "output", "setup"):
        if f"cpu_seconds_{name}" in told:
            found[name] = float(told[f"cpu_seconds_{name}"])
    return found


def lammps_loop(result: Path, law: str) -> float:
    """Processor time of the collapse of a dem.h5 in LAMMPS by a law of second_opinion [s]."""
    with temporary() as folder:
        second_opinion.run(result, folder, law)
        loops = LOOP.findall((folder / "log.lammps").read_text(errors="replace"))
    seconds, use = map(float, loops[-1])  # the one before it has settled the grains
    return seconds * use / 100


def measure(options, scene: Case, folder: Path) -> Rows:
    """`repeats` of each run, one of each after the other."""
    case, rows = packing.dict_of(scene), defaultdict(list)
    settled = packing.obtain(case, 1, kept("packings"), lambda done, text: None)
    log, result, path = folder / "log", folder / "dem.h5", scene.path.resolve()
    starts = {"this": module("dem_reference.run")}
    if options.before:
        begin = options.before.resolve() / "cases" / "start.py"
        starts["before"] = [PYTHON, "-I", "-X", "utf8", str(begin), "dem_reference.run"]
        grains(starts["before"], path, options.set, folder / "other.h5")  # makes its packing
    for _ in range(options.repeats):
        for name in reversed(starts):
            told = grains(starts[name], path, options.set, result)
            for part, seconds in parts(told).items():
                rows[name, part].append(seconds)
        steps = int(told["steps"])
        rows["bare", "engine"].append(run_engine(bare, case, settled, steps, log, log=log).result)
        for law in second_opinion.LAWS if options.lammps else ():
            rows[f"LAMMPS, {law}", "engine"].append(lammps_loop(result, law))
    return rows


def table_of(rows: Rows) -> pd.DataFrame:
    """A row for each run and part: median, least and most [s], and over the bare engine."""
    base = pd.Series(rows["bare", "engine"]).median()
    found = []
    for (run, part), seconds in rows.items():
        values = pd.Series(seconds)
        found.append(
            {
                "run": run,
                "part": part,
                "repeats": len(values),
                "median": round(values.median(), 3),
                "least": round(values.min(), 3),
                "most": round(values.max(), 3),
                "over_bare": round(values.median() / base, 3),
            }
        )
    return pd.DataFrame(found)


def main() -> int:
    parser = command_line.Parser(prog="dem_reference.timing", description=__doc__.split("\n")[0])
    parser.add_argument("case", metavar="CASE", help="case file, or a folder of a case.toml")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument(
        "--repeats", type=command_line.several, default=3, metavar="N", help="(%(default)s)"
    )
    parser.add_argument(
        "--before", type=Path, metavar="CLONE", help="another clone, whose run is timed as well"
    )
    parser.add_argument("--lammps", action="store_true", help="the same steps in LAMMPS as well")
    parser.add_argument("-o", "--output", type=Path, help="table (CSV)")
    options = parser.parse_args()
    if options.output:
        check_table(options.output)
    with temporary() as name:
        table = table_of(measure(options, load(options.case, options.set), name))
    if options.output:
        save(
            table,
            options.output,
            typed("python3 -m dem_reference.timing", sys.argv[1:]),
            "processor time [s] from the release on, packing not counted; collapse: all of it; "
            f"interleaved, on {cores.usable()} cores shared with other work (load "
            f"{os.getloadavg()[1]:.1f})",
        )
    print(table.to_string(index=False))
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(main))
