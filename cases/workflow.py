"""Runs many jobs through Snakemake: what is there is kept, what is missing is made, some at a time
or on a cluster.

A Snakefile finds its configuration in `config`; each job writes one file of the working folder, and
its words of failure to logs/<job>.log there. Text of a case travels in the configuration's file
alone: none reaches a shell.
"""

import fcntl
import importlib.util
import json
import os
import subprocess
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from cases.errors import EngineError
from cases.programs import ROOT, call, module, short, user_cache
from cases.scratch import locked, remove_dead


@dataclass(frozen=True)
class Where:
    """Jobs run on `cores` of this machine, or where the Snakemake profile in the folder `profile`
    sends them.
    """

    cores: int = 1
    profile: Path | None = None

    def words(self) -> list[str]:
        if self.profile:
            return ["--profile", str(self.profile.resolve())]
        return ["--cores", str(self.cores)]


def run(
    snakefile: Path, folder: Path, config: dict, where: Where, *, dry: bool = False, alone=False
):
    """Makes what the Snakefile asks for in `folder`, where an interrupted call is taken up again.

    The rules find `config` in the file config["file"], relative to the folder. A `dry` run only
    says which jobs there are. `alone` waits until no other call works in the folder. Raises
    EngineError, with the words of a job that failed.
    """
    logs, began = folder / "logs", time.time()
    logs.mkdir(parents=True, exist_ok=True)
    file = folder / f"config-{os.getpid()}.json"
    with ExitStack() as stack:
        if alone:
            lock = stack.enter_context((folder / "lock").open("w"))
            fcntl.flock(lock, fcntl.LOCK_EX)  # the kernel drops it with the process
        for old in folder.glob("config-*.json"):
            remove_dead(old)
        text = json.dumps(config | {"file": file.name}, indent=1)
        stack.enter_context(locked(file, folder, text))
        words = ["--snakefile", snakefile, "--configfile", file]
        words += ["--directory", folder, *where.words(), "--nolock", "--keep-going"]
        words += ["--rerun-incomplete", "--rerun-triggers", "mtime"]
        words += ["--dry-run"] if dry else ["--quiet", "all"]
        if not importlib.util.find_spec("snakemake"):
            raise EngineError(
                "snakemake: no such program (not installed) install the package snakemake"
            )
        done = call(
            module("snakemake", *words),
            cwd=ROOT,
            # Snakemake keeps a cache of its own, which it wants to write even without a home.
            env=os.environ | {"XDG_CACHE_HOME": str(user_cache(make=True))},
            capture_output=False,
            stdout=None if dry else subprocess.DEVNULL,
            stderr=None if dry else subprocess.PIPE,
        )
        if done.returncode:
            raise EngineError(failure(logs, began, done.stderr or ""))


def failure(logs: Path, began: float, said: str) -> str:
    """One line: the last words of the job that failed last since `began` [s], else Snakemake's."""
    written = {log: log.stat().st_mtime for log in logs.glob("*.log")}
    recent = [log for log, at in written.items() if at > began - 1.0]
    for log in sorted(recent, key=written.__getitem__, reverse=True):
        if lines := log.read_text(errors="replace").strip().splitlines():
            return f"{lines[-1]} (see {short(log)}; what came through is kept: run it again)"
    line = (said.strip().splitlines() or ["it said nothing"])[-1].strip()
    return f"snakemake: stopped ({line}) in {short(logs.parent)}"
