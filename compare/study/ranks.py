"""How much faster more ranks step a continuum, and what they tell each other.

    python3 -m compare.study.ranks CASE [--set key=value]... [--begin T] [--repeats N]
        [-o TABLE.csv]

The case on one rank and on two; a column twice as long on two; and the case on two whose columns
of cells stay with the rank that has them at the start. One after the other, `repeats` times. The
time of a step is that of a run to time.maximum less one to `begin` [sqrt(H/g)], so that start and
end of the program do not count. `model` tells of it what more ranks would take.
"""

import os
import sys
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from cases import command_line, cores, reading
from cases.case import load
from cases.errors import CaseError, EngineError, exit_code
from cases.files import check_table, write_table
from cases.programs import call, program
from cases.provenance import about, head, typed
from cases.scratch import temporary

RUNS = {  # ranks, times the length, whether columns of cells change hands
    "one": (1, 1, True),
    "two": (2, 1, True),
    "two, twice as long": (2, 2, True),
    "two, never dealt out anew": (2, 1, False),
}
MODELLED = [(1e6, 2), (1e7, 12), (1e8, 28), (1e9, 62)]  # points, ranks
LEAST = 8  # cells along x of a rank
PER_CELL = 8  # points, of a cell in space
SWAPS, GATHERINGS = 3, 2  # of a step: nodes, rates, pressures; the ledger, failures
TOLD = 200  # by each rank at a gathering [bytes]


def run(case: Path, sets: list[str], ranks: int, anew: bool, result: Path) -> dict[str, float]:
    """Steps, time of the clock [s], processor time of the steps [s], imbalance, bytes sent."""
    words = [program("mpm_run"), case, "-o", result, "--quiet", "--ranks", ranks]
    around = dict(os.environ) if anew else os.environ | {"GRAINPAIR_KEEP_CUTS": "1"}
    done = call([*words, *(word for one in sets for word in ("--set", one))], env=around)
    if done.returncode:
        raise EngineError(done.stderr.strip())
    with reading.result(result) as file:
        told = reading.attributes(file)
        points = len(file["data/0/particles/cloud/mass"])
    return {
        "points": points,
        "steps": told["steps"],
        "wall": told["wall_seconds"],
        "cpu": told["cpu_seconds_engine"],
        "imbalance": told.get("rank_imbalance", 1.0),
        "sent": told.get("rank_sent_bytes", 0.0),
    }


def measure(options, folder: Path) -> pd.DataFrame:
    """A row for each of RUNS: times of a step, median, least and most."""
    case = Path(options.case).resolve()
    length = load(case, options.set)["geometry.length"]
    found: dict[str, list[dict[str, float]]] = defaultdict(list)
    for _ in range(options.repeats):
        for name, (ranks, times, anew) in RUNS.items():
            sets = [*options.set, f"geometry.length={float(times * length)!r}"]
            sets += ["time.frame_interval=100", "output.checkpoint_interval=0"]
            begin = [*sets, f"time.maximum={float(options.begin)!r}"]
            short, long = (run(case, some, ranks, anew, folder / "r.h5") for some in (begin, sets))
            steps = long["steps"] - short["steps"]
            found[name].append(
                {key: (long[key] - short[key]) / steps for key in ("wall", "cpu", "sent")}
                | {"points": long["points"], "imbalance": long["imbalance"], "steps": steps}
            )
    return table_of(found)


def table_of(found: dict[str, list[dict[str, float]]]) -> pd.DataFrame:
    rows = []
    for name, repeats in found.items():
        some = pd.DataFrame(repeats)
        rows.append(
            {
                "run": name,
                "ranks": RUNS[name][0],
                "points": int(some["points"].iloc[0]),
                "steps": int(some["steps"].iloc[0]),
                "repeats": len(some),
                "step_seconds": round(float(some["wall"].median()), 7),
                "least": round(float(some["wall"].min()), 7),
                "most": round(float(some["wall"].max()), 7),
                "step_cpu_seconds": round(float(some["cpu"].median()), 7),
                "imbalance": round(float(some["imbalance"].median()), 4),
                "sent_bytes": round(float(some["sent"].median())),
            }
        )
    return pd.DataFrame(rows)


def of(table: pd.DataFrame, name: str, what: str) -> float:
    return float(table.set_index("run").at[name, what])


def faster(table: pd.DataFrame) -> float:
    """How many times two ranks are as fast as one, by the medians."""
    return of(table, "one", "step_seconds") / of(table, "two", "step_seconds")


@dataclass(frozen=True)
class Network:
    """Between ranks: what a message takes, and how much goes at a time."""

    latency: float = 2e-6  # [s]
    rate: float = 5e9  # [bytes/s]


def model(table: pd.DataFrame, points: float, ranks: int, network: Network) -> dict[str, float]:
    """Time of the clock of a step [s] of a cube of so many points, by what it goes to: own points,
    the fullest rank's beyond the mean, and messages. A border's grow with the cube's cross-section.
    """
    own = of(table, "one", "step_cpu_seconds") * points / of(table, "one", "points") / ranks
    if ranks == 1:
        return {"own": own, "uneven": 0.0, "messages": 0.0}
    section = (points / of(table, "two", "points")) ** (2 / 3)
    sent = 2 * of(table, "two", "sent_bytes") * section  # to either side
    calls = SWAPS + GATHERINGS * (ranks - 1).bit_length()
    messages = calls * network.latency + (sent + GATHERINGS * ranks * TOLD) / network.rate
    return {"own": own, "uneven": own * unevenness(points, ranks), "messages": messages}


def unevenness(points: float, ranks: int) -> float:
    """Of a cube of whole columns of cells, what the fullest rank has beyond the mean."""
    share = (points / PER_CELL) ** (1 / 3) / ranks
    return max(0.05, 1 / share)  # ranks deal out anew beyond a twentieth


def page(table: pd.DataFrame) -> str:
    """The model as docs/reference/cluster.md has it."""
    lines = [
        "| points | ranks | a step | own | uneven | messages | times faster |",
        "|---|---|---|---|---|---|---|",
    ]
    for points, ranks in MODELLED:
        alone, told = (sum(model(table, points, n, Network()).values()) for n in (1, ranks))
        parts = model(table, points, ranks, Network()).values()
        shares = " | ".join(f"{100 * part / told:.0f} %" for part in parts)
        line = f"| {points:.0e} | {ranks} | {told:.2g} s | {shares} | {alone / told:.1f} |"
        lines.append(line.replace("e+0", "e"))
    return "\n".join(lines)


def main() -> int:
    parser = command_line.Parser(prog="compare.study.ranks", description=__doc__.split("\n")[0])
    parser.add_argument("case", metavar="CASE", help="case file, or a folder of a case.toml")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--begin", type=float, default=0.004, metavar="T")
    parser.add_argument("--repeats", type=command_line.several, default=3, metavar="N")
    parser.add_argument("-o", "--output", type=Path, help="table (CSV)")
    options = parser.parse_args()
    end = load(options.case, options.set)["time.maximum"]
    if not 0.0 < options.begin < end:
        raise CaseError(f"--begin {options.begin:g}: not between 0 and time.maximum = {end:g}")
    if options.output:
        check_table(options.output)
    with temporary() as folder:
        table = measure(options, folder)
    if options.output:
        told = (
            "step_seconds: of the clock, its median, least and most; step_cpu_seconds: of all "
            "ranks; imbalance: points of the fullest rank over the mean; sent_bytes: by it "
            "in a step; "
            f"interleaved, on {cores.usable()} cores (load {os.getloadavg()[1]:.1f})"
        )
        command = typed("python3 -m compare.study.ranks", sys.argv[1:])
        write_table(options.output, head(about(command), told), table)
    print(table.to_string(index=False))
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(main))
