"""Cores that a process may use, and what to do beside each other on them."""

import os
from dataclasses import dataclass
from math import ceil
from pathlib import Path

from cases import memory

JOB_BYTES = 0.5e9  # of a job of a study: Python, and an engine with a column of the shipped cases
RANK_BYTES = 1e8  # of a process under MPI besides its share; of the grains 9e7 with Python and all
POINTS_PER_THREAD = 4000  # fewer, and threads wait for each other longer than they work


def usable(root: Path = Path("/")) -> int:
    """Those that the scheduler gives this process, or what its control group's quota of processor
    time is worth where that is less; one at least.
    """
    quotas = [quota(folder) for folder in memory.groups("cpu", root)]
    return max(1, min([len(os.sched_getaffinity(0)), *(ceil(one - 1e-9) for one in quotas if one)]))


def quota(folder: Path) -> float:
    """Processors that a control group's quota is worth; 0 where it has none."""
    if (folder / "cpu.max").exists():
        words = (folder / "cpu.max").read_text().split()
        return 0.0 if words[0] == "max" else float(words[0]) / float(words[1])
    most, period = (memory.number_in(folder / f"cpu.cfs_{name}_us") for name in ("quota", "period"))
    return most / period if 0 < most < memory.NO_LIMIT and period < memory.NO_LIMIT else 0.0


def jobs(bytes_each: float = JOB_BYTES, cores: int | None = None) -> int:
    """Jobs of one thread beside each other: as many as there are cores and memory for; one at
    least.
    """
    return max(1, min(cores or usable(), int(memory.available() / bytes_each)))


@dataclass(frozen=True)
class Plan:
    """How a paired run shares the cores."""

    grains: int  # runs of the grains at a time
    threads: int  # of each rank of the continuum
    beside: bool  # the continuum beside the grains, not after them
    siblings_beside: bool  # its siblings beside it, with one thread, not after it
    ranks: int = 1  # of each run of the grains, and of the continuum

    @property
    def busy(self) -> int:
        """Most cores in use at a time."""
        grains, continuum = (self.ranks * one for one in (self.grains, self.threads))
        continuum += self.siblings_beside
        return grains + continuum if self.beside else max(grains, continuum)


def plan(
    cores: int,
    points: int,
    seeds: int,
    *,
    siblings: bool,
    waits: bool,
    threads: int | None = None,
    ranks: int = 1,
) -> Plan:
    """All cores busy and no more: the grains first, which take longest, then the siblings, and what
    is left as threads of the continuum as far as its `points` go round. `waits`: the continuum
    starts from the grains. `threads` and `ranks` are the user's, who may ask for more than there
    is; each rank of either engine takes a core, of the continuum one for each thread.
    """
    beside = cores >= 2 * ranks and not waits
    grains = max(1, min(seeds, (cores - ranks if beside else cores) // ranks))
    left = cores - ranks * grains if beside else cores
    siblings_beside = siblings and left > ranks * (threads or 1)
    most = max(1, points // (ranks * POINTS_PER_THREAD))
    own = threads or max(1, min((left - siblings_beside) // ranks, most))
    return Plan(grains, own, beside, siblings_beside, ranks)
