"""Jobs on this machine, as many beside each other as there are cores for.

Whoever does a job holds the lock of its log; so two calls that share jobs do each once, and what a
killed call leaves is free again.
"""

import signal
import subprocess
import time
from collections.abc import Mapping
from pathlib import Path

from cases import children
from cases.jobs import Job, Unmade, last_words, start
from cases.scratch import take

INTERVAL = 0.05  # [s] between two looks at who has ended


def run(jobs: Mapping[str, Job], logs: Path, cores: int) -> list[Unmade]:
    """Does the jobs in their order, each as soon as its cores are free; returns those that failed,
    in the order of their ends. Whoever ends this process ends them too.
    """
    waiting, running, failed = dict(jobs), dict[str, subprocess.Popen](), list[Unmade]()
    try:
        while waiting or running:
            start_next(waiting, running, jobs, logs, cores)
            time.sleep(INTERVAL)
            for name, process in list(running.items()):
                if process.poll() is not None:
                    del running[name]
                    if not jobs[name].file.exists():
                        failed.append(unmade(name, process.returncode, logs / f"{name}.log"))
    finally:
        children.end(*running.values(), group=True)
    return failed


def start_next(
    waiting: dict[str, Job],
    running: dict[str, subprocess.Popen],
    jobs: Mapping[str, Job],
    logs: Path,
    cores: int,
):
    """Moves those from `waiting` to `running` that there are cores for; leaves those that another
    call is doing, and drops those that it has done. One that asks for too many runs alone.
    """
    free = cores - sum(jobs[name].cores for name in running)
    for name, job in list(waiting.items()):
        if job.file.exists():
            del waiting[name]
        elif running and job.cores > free:
            return
        elif (log := take(logs / f"{name}.log")) is not None:
            del waiting[name]
            running[name] = start(job, log)
            free -= job.cores


def unmade(name: str, code: int, log: Path) -> Unmade:
    """A job that has ended without its file."""
    if said := last_words(log):
        return Unmade(said, log)
    if code < 0:
        return Unmade(f"{name}: killed by {signal.Signals(-code).name}", log)
    return Unmade(f"{name}: ended with code {code}, without a result and without a word", log)
