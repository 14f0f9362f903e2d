"""Runs many jobs beside each other, on this machine or on a cluster: what is there is kept, what is
missing is made, and a call that was stopped is taken up again by the next.

What a job is told are words of a list, which no shell reads.
"""

import time
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from cases import cluster, pool
from cases.errors import EngineError
from cases.jobs import Job
from cases.members import Members, shown
from cases.programs import short
from cases.scratch import locked


@dataclass(frozen=True)
class Where:
    """Jobs take `cores` of this machine, or go where the Snakemake profile in the folder `profile`
    sends them.
    """

    cores: int = 1
    profile: Path | None = None


def run(
    jobs: Mapping[str, Job],
    folder: Path,
    where: Where,
    members: Members,
    *,
    dry: bool = False,
    alone: bool = False,
):
    """Makes the files of the jobs that are missing, those first that take longest; each job's words
    of failure go to logs/<name>.log in `folder`. How far they are is shown as that of `members`,
    which has the same names.

    A `dry` run only says which jobs there are. `alone` refuses while another call works in the
    folder; else two calls may share jobs, and each is made once. Raises CaseError, and EngineError
    with the words of the job that failed first, when all others are done.
    """
    missing = {name: job for name, job in jobs.items() if not job.file.exists()}
    if dry:
        for name, job in missing.items():
            print(f"{members.labels.get(name, name)}: {short(job.file)} is missing")
        return
    seconds = members.seconds
    missing = {
        name: missing[name] for name in sorted(missing, key=lambda one: -seconds.get(one, 0.0))
    }
    logs, began = folder / "logs", time.time()
    logs.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        if alone:
            stack.enter_context(locked(folder / "lock", folder))
        stack.enter_context(shown(members, logs, began))
        if where.profile:
            failed = cluster.run(jobs, folder, where.profile)
        else:
            failed = pool.run(missing, logs, where.cores)
    if failed:
        raise EngineError(str(failed[0]))
