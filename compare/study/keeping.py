"""What keeping costs: runs of either engine without checkpoints, with the usual ones, with many,
and of another clone that kept nothing and checked less; several times over and interleaved.

    python3 -m compare.study.keeping CASE [--repeats N] [--often SECONDS] [--before CLONE BUILD]
        [-o TABLE.csv]

Costs are processor time of whole runs, packings not counted. What each repeat's runs cost is told
by its own "never", which they stand beside.
"""

import os
import sys
from collections import defaultdict
from pathlib import Path

import pandas as pd

from cases import command_line, cores, reading
from cases.case import load
from cases.errors import CaseError, EngineError, exit_code
from cases.files import check_table, write_table
from cases.programs import PYTHON, call, module, program
from cases.provenance import about, head, typed
from cases.scratch import temporary

ENGINES = {"mpm": "mpm.h5", "dem": "dem.h5"}


def start(engine: str, clone: Path | None, build: Path | None) -> tuple[list, dict[str, str]]:
    """The words that an engine's command line begins with, and its environment."""
    words: list = [program("mpm_run")] if engine == "mpm" else module("dem_reference.run")
    if clone is None or build is None:
        return words, dict(os.environ)
    if engine == "mpm":
        words = [build.resolve() / "mpm_run"]
    else:
        begin = clone.resolve() / "cases" / "start.py"
        words = [PYTHON, "-I", "-X", "utf8", begin, "dem_reference.run"]
    return words, os.environ | {"GRAINPAIR_BUILD": str(build.resolve())}


def cost(words: list, case: Path, sets: list[str], result: Path, environment: dict) -> float:
    """Processor time of a run without its packing [s]."""
    line = [*words, case, "-o", result, "--quiet"]
    done = call([*line, *(word for one in sets for word in ("--set", one))], env=environment)
    if done.returncode:
        raise EngineError(done.stderr.strip())
    with reading.result(result) as file:
        told = reading.attributes(file)
    return float(told.get("cpu_seconds_collapse", told["cpu_seconds"]))


def measure(options, folder: Path) -> dict[tuple[str, str], list[float]]:
    """Seconds of each repeat, by engine and run."""
    key, case = "output.checkpoint_interval", Path(options.case).resolve()
    runs: dict[str, tuple] = {
        "never": (None, None, [f"{key}=0"]),
        "usual": (None, None, []),
        "often": (None, None, [f"{key}={float(options.often)!r}"]),
    }
    if options.before:
        runs["before"] = (*map(Path, options.before), [])
    rows = defaultdict(list)
    for repeat in range(options.repeats):
        for engine, name in ENGINES.items():
            order = list(runs) if repeat % 2 else list(reversed(runs))
            for run in order:
                clone, build, sets = runs[run]
                words, environment = start(engine, clone, build)
                spent = cost(words, case, [*options.set, *sets], folder / name, environment)
                rows[engine, run].append(spent)
    return rows


def table_of(rows: dict[tuple[str, str], list[float]]) -> pd.DataFrame:
    """A row for each engine and run: seconds, and over "never" of the same repeat, as median, least
    and most [%].
    """
    found = []
    for (engine, run), seconds in rows.items():
        beside = pd.Series(rows[engine, "never"])
        over = 100.0 * (pd.Series(seconds) / beside - 1.0)
        found.append(
            {
                "engine": engine,
                "run": run,
                "repeats": len(seconds),
                "cpu_seconds": round(pd.Series(seconds).median(), 3),
                "over_never": round(over.median(), 2),
                "least": round(over.min(), 2),
                "most": round(over.max(), 2),
            }
        )
    return pd.DataFrame(found)


def main() -> int:
    parser = command_line.Parser(
        prog="compare.study.keeping", description=(__doc__ or "").split("\n\n")[0]
    )
    parser.add_argument("case", metavar="CASE", help="case file, or a folder of a case.toml")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--repeats", type=command_line.several, default=5, metavar="N")
    parser.add_argument("--often", type=float, default=1.0, metavar="SECONDS")
    parser.add_argument("--before", nargs=2, metavar=("CLONE", "BUILD"))
    parser.add_argument("-o", "--output", type=Path, help="table (CSV)")
    options = parser.parse_args()
    load(options.case, options.set)
    if options.often <= 0.0:
        raise CaseError(f"--often {options.often:g}: no time between checkpoints give one above 0")
    if options.output:
        check_table(options.output)
    with temporary() as folder:
        table = table_of(measure(options, folder))
    if options.output:
        told = (
            "processor time of whole runs without packing [s]; over_never, least, most: beside the "
            f"run without checkpoints of the same repeat [%]; interleaved, on {cores.usable()} "
            f"cores shared with other work (load {os.getloadavg()[1]:.1f})"
        )
        command = typed("python3 -m compare.study.keeping", sys.argv[1:])
        write_table(options.output, head(about(command), told), table)
    print(table.to_string(index=False))
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(main))
