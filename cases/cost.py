"""What a run will take, told from its case before it starts; and what a machine cannot give.

The figures are those of cases/rates.toml. `mpm_run --estimate` tells the continuum's,
dem_reference/cost.py the grains', compare/cost.py both.
"""

import json
import tomllib
from dataclasses import dataclass
from functools import cache

from cases import memory
from cases.case import Case
from cases.errors import CaseError, EngineError
from cases.programs import ROOT, call, program
from cases.scratch import temporary

LONG = 3600.0  # [s] that a user is told of beforehand


@dataclass(frozen=True)
class Cost:
    """Of one engine; a run that comes to rest early takes fewer steps."""

    counts: dict[str, int]  # of what there is: points and nodes, or grains and contacts
    time_step: float  # the first [s]
    steps: float
    bytes: float  # of memory
    seconds: float  # of one processor
    disk: float  # [bytes]


@cache
def rates() -> dict:
    return tomllib.loads((ROOT / "cases" / "rates.toml").read_text())


def continuum(case: Case) -> Cost:
    """Raises CaseError where the case has no grid; EngineError if mpm_run is not built."""
    with temporary() as folder:
        file = folder / "case.toml"
        file.write_text(case.resolved)
        done = call([program("mpm_run"), file, "--estimate"])
        if done.returncode:
            line = done.stderr.strip().replace(str(file), str(case.path))
            raise CaseError(line) if done.returncode == 2 else EngineError(line)
    told = json.loads(done.stdout)
    return Cost(
        {name: told[name] for name in ("points", "nodes")},
        *(told[name] for name in ("time_step", "steps", "bytes", "seconds", "disk")),
    )


def refuse_more_than_there_is(where: str, cost: Cost, hint: str):
    """Raises CaseError where a run takes more memory than there is; `where` says of what."""
    there = memory.available()
    if cost.bytes > there:
        counts = " and ".join(f"{count:.3g} {name}" for name, count in cost.counts.items())
        raise CaseError(
            f"{where} takes about {cost.bytes / 1e9:.3g} GB of memory, for {counts} (there are "
            f"{there / 1e9:.3g} GB) {hint}"
        )


def duration(seconds: float) -> str:
    """In the unit that a reader would take."""
    for unit, length in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * length:
            return f"{seconds / length:.3g} {unit}"
    return f"{seconds:.2g} s"
