"""How much faster more ranks are, and what they tell each other.

    python3 -m dem_reference.scaling CASE [--ranks N...] [--set key=value]... [--repeats N]
        [--packings DIR] [-o TABLE.csv]

The collapse of the same packing on each number of ranks, one after the other, `repeats` times: time
of the clock, from the release to the complete result, and processor time of all ranks. Then once
more, what the fullest rank holds, and what it sends [bytes]. `model` tells of it what more ranks
would take.
"""

import os
import sys
import time
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from cases import command_line, cores
from cases.case import load
from cases.errors import exit_code
from cases.files import check_table
from cases.programs import kept, module
from cases.provenance import typed
from cases.scratch import temporary

from . import packing
from .ensemble import save
from .plan import Plan
from .ranks import run_on_ranks
from .shared import SharedAccounts, SharedColumn, audit_of
from .timing import grains as timed
from .world import World

SAMPLES = 100  # of the contacts, over which messages are counted
ID_BYTES = 4
MODELLED = [(3e4, 2), (3e4, 8), (1e6, 8), (1e6, 64), (1e7, 64)]  # grains, ranks
ENGINE_BYTES = 72  # of a grain that is shown to a neighbour in a step: place, velocity, spin
UNITS = {"wall": "s", "sent": "bytes", "cpu": "s", "seconds": "s"}


class Counting(World):
    """A world that counts what this rank sends, by the kind of call [bytes]."""

    def __init__(self, mpi: Any):
        super().__init__(mpi)
        self.sent: dict[str, int] = defaultdict(int)

    def swap(self, rows: np.ndarray, going: np.ndarray, coming: np.ndarray) -> np.ndarray:
        own = int(going[self.rank])
        self.sent["swap"] += (len(rows) - own) * rows[:1].nbytes
        return super().swap(rows, going, coming)

    def everywhere(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.sent["everywhere"] += rows.nbytes * (self.size - 1)
        return super().everywhere(rows)

    def gather(self, rows: np.ndarray) -> np.ndarray:
        self.sent["gather"] += rows.nbytes
        return super().gather(rows)


def messages(world: World, case: dict, settled: Path, log: Path, _voice: Any) -> dict[str, float]:
    """What the fullest rank holds, and what it sends, over SAMPLES from the release on; and how
    long a row of the history takes [s].
    """
    counting = Counting(world.mpi)
    column = SharedColumn(case, settled, log, counting)
    audit = audit_of(case, column, SharedAccounts)
    engine, plan = column.engine, column.plan
    counting.sent.clear()
    listings, alone = 0, []
    for k in range(SAMPLES):
        before = column.border.version
        engine.advance(plan.sample)
        audit.accounts.add(column.look((k + 1) * plan.sample * plan.dt))
        listings += column.border.version - before
    swapped, listed = counting.sent["swap"], counting.sent["everywhere"]
    for _ in range(5):
        began = time.monotonic()
        audit.row(column.moment, 0.0)
        alone.append(time.monotonic() - began)
    shown = ENGINE_BYTES * engine.ghosts()
    told = {
        "grains_most": engine.here(),
        "ghosts_most": engine.ghosts(),
        "sent_step": shown,
        "sent_sample": swapped / SAMPLES,
        "sent_listing": listed / max(1, listings),
        "sent_row": counting.sent["gather"] / 5,
        "listings_sample": listings / SAMPLES,
        "seconds_row": float(np.median(alone)),
    }
    return dict(zip(told, counting.most(list(told.values())).tolist()))


def measure(options, ranks: list[int], folder: Path) -> pd.DataFrame:
    """A row for each number of ranks and quantity: median, least and most."""
    case = load(options.case, options.set)
    tables, path, store = packing.dict_of(case), case.path.resolve(), options.packings
    settled = packing.obtain(tables, 1, store, lambda done, text: None)
    rows: dict[tuple[int, str], list[float]] = defaultdict(list)
    steps = 0
    for _ in range(options.repeats):
        for count in ranks:
            start = module("dem_reference.run", "--ranks", count, "--packings", store)
            told = timed(start, path, options.set, folder / "dem.h5")
            steps = int(told["steps"])
            rows[count, "wall"].append(float(told["wall_seconds"]))
            for part in ("collapse", "engine", "audit", "output", "setup"):
                rows[count, f"cpu_{part}"].append(float(told[f"cpu_seconds_{part}"]))
    for count in ranks:
        log = folder / f"{count}" / "log"
        log.parent.mkdir()
        told = run_on_ranks(messages, tables, settled, log, ranks=count, log=log).result
        for name, value in told.items():
            rows[count, name].append(value)
    plan = Plan.of(tables)
    base = {"steps": steps, "samples": steps // plan.sample, "rows": steps // plan.row}
    base["frames"] = steps // plan.frame + 1
    rows |= {(0, name): [float(value)] for name, value in base.items()}
    return table_of(rows)


def table_of(rows: dict[tuple[int, str], list[float]]) -> pd.DataFrame:
    """Ranks 0: of the run, whatever the ranks."""
    found = []
    for (ranks, what), values in rows.items():
        some = pd.Series(values)
        found.append(
            {
                "ranks": ranks,
                "what": what,
                "unit": UNITS.get(what.split("_")[0], "-"),
                "repeats": len(values),
                "median": round(float(some.median()), 6),
                "least": round(float(some.min()), 6),
                "most": round(float(some.max()), 6),
            }
        )
    return pd.DataFrame(found)


def of(table: pd.DataFrame, ranks: int, what: str) -> float:
    """A median of a table."""
    found = table[(table["ranks"] == ranks) & (table["what"] == what)]["median"]
    return float(found.iloc[0])


@dataclass(frozen=True)
class Network:
    """Between ranks: what a message takes, and how much goes at a time."""

    latency: float = 2e-6  # [s]
    rate: float = 5e9  # [bytes/s]


def model(table: pd.DataFrame, grains: float, ranks: int, network: Network) -> dict[str, float]:
    """Time of the clock [s] of the run of a table, were it so wide that it had `grains`, by what it
    goes to.

    Of what ranks share each has its part, and of its neighbours' what two ranks were measured to
    take more than one. What the first rank does for all, rows of the history and frames, is not
    shared. Messages: four of the engine's in a step, along two axes; three calls at a sample, in
    which every rank hears of every other; all ids to all at a listing.
    """
    steps, samples, rows = (of(table, 0, name) for name in ("steps", "samples", "rows"))
    scale = grains / of(table, 1, "grains_most")
    row = rows * of(table, 1, "seconds_row")
    shared = (of(table, 1, "cpu_engine") + of(table, 1, "cpu_audit") - row) * scale / ranks
    told = {
        "own": shared,
        "neighbours": 0.0,
        "messages": 0.0,
        "rows": row * scale,
        "frames": of(table, 1, "cpu_output") * scale,
    }
    if ranks > 1:
        listings = samples * of(table, 2, "listings_sample")
        sent = steps * of(table, 2, "sent_step") + samples * of(table, 2, "sent_sample")
        sent += listings * ID_BYTES * grains
        calls = 4 * steps + (3 * samples + listings) * ranks
        told["neighbours"] = shared * overlap(table)
        told["messages"] = calls * network.latency + sent / network.rate
    return told


def overlap(table: pd.DataFrame) -> float:
    """What two ranks take more than one of what they share, as a part of it."""
    one, two = (of(table, n, "cpu_engine") + of(table, n, "cpu_audit") for n in (1, 2))
    return max(0.0, two / one - 1)


def page(table: pd.DataFrame) -> str:
    """The model as docs/reference/cluster.md has it."""
    lines = [
        "| grains | ranks | own | neighbours | messages | rows | frames | times faster |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for grains, ranks in MODELLED:
        alone, told = (model(table, grains, count, Network()) for count in (1, ranks))
        whole = sum(told.values())
        shares = " | ".join(f"{100 * part / whole:.0f} %" for part in told.values())
        faster = sum(alone.values()) / whole
        lines.append(f"| {grains:.0e} | {ranks} | {shares} | {faster:.1f} |".replace("e+0", "e"))
    return "\n".join(lines)


def main() -> int:
    parser = command_line.Parser(prog="dem_reference.scaling", description=__doc__.split("\n")[0])
    parser.add_argument("case", metavar="CASE", help="case file, or a folder of a case.toml")
    parser.add_argument(
        "--ranks", type=command_line.threads, nargs="+", default=[1, 2], help="(default 1 2)"
    )
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--repeats", type=command_line.several, default=3, metavar="N")
    parser.add_argument("--packings", type=Path, default=kept("packings"), metavar="DIR")
    parser.add_argument("-o", "--output", type=Path, help="table (CSV)")
    options = parser.parse_args()
    if options.output:
        check_table(options.output)
    with temporary() as folder:
        table = measure(options, options.ranks, folder)
    if options.output:
        save(
            table,
            options.output,
            typed("python3 -m dem_reference.scaling", sys.argv[1:]),
            "wall: of the clock, from the release on, packing not counted; cpu: of all ranks; "
            "grains, ghosts, sent: of the fullest rank, by a step, a sample of the contacts, a "
            "listing of neighbours, a row of the history; ranks 0: of the run; interleaved, on "
            f"{cores.usable()} cores shared with other work (load {os.getloadavg()[1]:.1f})",
        )
    print(table.to_string(index=False))
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(main))
