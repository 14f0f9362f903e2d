"""Jobs on a cluster, handed out by Snakemake and a profile of it.

The jobs stand in a file, and shells are told its name and theirs alone: Snakemake has a shell
between itself and its jobs. So the rule says `shell:` and a line of constants: of `run:` Snakemake
makes a shell line of its own, with paths unquoted.
"""

import importlib.util
import os
import subprocess
import time
from collections.abc import Mapping
from pathlib import Path

from cases.errors import CaseError, EngineError
from cases.jobs import Job, Unmade, text_of
from cases.programs import MARKS, ROOT, call, module, plain, user_cache
from cases.scratch import locked, remove_dead

SNAKEFILE = Path(__file__).with_name("Snakefile")


def run(jobs: Mapping[str, Job], folder: Path, profile: Path) -> list[Unmade]:
    """Does the jobs, whose files lie in `folder` and are called by their names and one suffix;
    returns those that failed, the last first. Raises CaseError where a shell would read the name
    of a folder, and EngineError.
    """
    check(folder)
    for old in folder.glob("jobs-*.json"):
        remove_dead(old)
    if not jobs:
        return []
    (suffix,) = {job.file.name.removeprefix(name) for name, job in jobs.items()}
    began, file = time.time(), folder / f"jobs-{os.getpid()}.json"
    words = ["--snakefile", SNAKEFILE, "--config", f"jobs={file.name}", f"suffix={suffix}"]
    words += ["--directory", folder, "--profile", profile.resolve(), "--nolock", "--keep-going"]
    words += ["--rerun-incomplete", "--rerun-triggers", "mtime", "--quiet", "all"]
    with locked(file, folder, text_of(jobs)):
        done = call(
            module("snakemake", *words),
            cwd=ROOT,
            # Snakemake keeps a cache of its own, which it wants to write even without a home.
            env=os.environ | {"XDG_CACHE_HOME": str(user_cache(make=True))},
            stdout=subprocess.DEVNULL,
            start_new_session=True,  # it is ended with all its jobs (cases/children.py)
        )
    if not done.returncode:
        return []
    line = (done.stderr.strip().splitlines() or ["it said nothing"])[-1].strip()
    logs = [log for name in jobs if (log := folder / "logs" / f"{name}.log").exists()]
    times = {log: log.stat().st_mtime for log in logs if log.stat().st_size}
    recent = [log for log, at in times.items() if at > began - 1.0]
    if not recent:
        raise EngineError(f"snakemake: stopped ({line})")
    return [Unmade(line, log) for log in sorted(recent, key=times.__getitem__, reverse=True)]


def check(folder: Path):
    """Raises CaseError or EngineError where no cluster can be told of the folder."""
    for path in (ROOT, folder.resolve()):
        if not plain(str(path)):
            raise CaseError(
                f"{path}: cannot be told to a cluster (a shell there would read its name) "
                f"work in a folder of plain letters, digits and {MARKS}"
            )
    if not importlib.util.find_spec("snakemake"):
        raise EngineError(
            "snakemake: no such program (not installed) install the package snakemake"
        )
