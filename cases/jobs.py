"""A job: what is run beside others of its kind (cases/workflow.py).

    python3 -m cases.jobs FILE BUNDLE

does those of a bundle that are missing, one after the other; FILE holds bundles, as `text_of` has
made it. So it is called on a cluster. The words of each go to logs/<name>.log beside FILE.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from cases import children
from cases.programs import ROOT, module, program, short
from cases.scratch import take

BUILT = ("mpm_run",)  # programs, else words begin with a module
INTERVAL = 1.0  # [s] between two looks at a job that somebody else does


@dataclass(frozen=True)
class Job:
    """Makes `file`, whole or not at all: a module of ours, or a program that is built, and its
    words, started in the project's folder; the cores that it takes, and as estimated the processor
    time [s] and memory [bytes], 0 where nobody knows.
    """

    file: Path
    words: tuple[str, ...]
    cores: int = 1
    seconds: float = 0.0
    bytes: float = 0.0

    @property
    def command(self) -> list[str]:
        first, *more = self.words
        return [str(program(first)), *more] if first in BUILT else module(*self.words)


@dataclass(frozen=True)
class Unmade:
    """A job that did not make its file: why, in a line, and its log."""

    why: str
    log: Path

    def __str__(self):
        where = f"see {short(self.log)}; " if self.log.exists() else ""
        return f"{self.why} ({where}what came through is kept: run it again)"


def last_words(log: Path) -> str:
    """The last line of a job's log; "" where it said nothing."""
    said = log.read_text(errors="replace").strip() if log.exists() else ""
    return said.splitlines()[-1] if said else ""


def start(job: Job, log: int) -> subprocess.Popen:
    """Begins a job that says what is wrong to the open file `log`, whose lock it inherits."""
    try:
        os.truncate(log, 0)
        os.utime(log)  # it begins now, though it may have been empty before
        return children.start(
            job.command,
            cwd=ROOT,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=log,
            start_new_session=True,  # it is ended by us, with all that it has started
        )
    finally:
        os.close(log)


def text_of(bundles: Mapping[str, Mapping[str, Job]]) -> str:
    """Bundles of jobs as JSON, by their names."""
    told = {
        bundle: {name: asdict(job) for name, job in jobs.items()}
        for bundle, jobs in bundles.items()
    }
    return json.dumps(told, default=str, indent=1)


def read(file: Path) -> dict[str, dict[str, Job]]:
    """What `text_of` has told."""
    return {
        bundle: {
            name: Job(**told | {"file": Path(told["file"]), "words": tuple(told["words"])})
            for name, told in jobs.items()
        }
        for bundle, jobs in json.loads(file.read_text()).items()
    }


def do(job: Job, log: Path) -> bool:
    """Makes the file of a job, unless it is there, or waits for whoever is making it."""
    while not job.file.exists():
        if (taken := take(log)) is not None:
            process = start(job, taken)
            try:
                process.wait()
            finally:
                children.end(process, group=True)
            return job.file.exists()
        time.sleep(INTERVAL)
    return True


def main(file: str, bundle: str) -> int:
    logs = Path(file).resolve().parent / "logs"
    jobs = read(Path(file))[bundle]
    return 0 if all([do(job, logs / f"{name}.log") for name, job in jobs.items()]) else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
