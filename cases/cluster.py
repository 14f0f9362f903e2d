"""Jobs on a cluster, handed out by Snakemake and a profile of it.

The jobs stand in a file, and shells are told its name and theirs alone: Snakemake has a shell
between itself and its jobs. So the rule says `shell:` and a line of constants: of `run:` Snakemake
makes a shell line of its own, with paths unquoted.

Jobs of minutes go together in bundles, each of which is one job of the cluster. A bundle is known
by the jobs that it was made of, the done ones among them: so a call finds those again that an
earlier one has left on the cluster, waiting or running.
"""

import hashlib
import importlib.util
import json
import os
import subprocess
import time
import tomllib
from collections.abc import Mapping
from math import ceil
from pathlib import Path

from cases.errors import CaseError, EngineError
from cases.files import write_atomically
from cases.jobs import Job, Unmade, last_words, read, text_of
from cases.programs import MARKS, ROOT, call, module, plain, user_cache

SNAKEFILE = Path(__file__).with_name("Snakefile")
PROFILE = SNAKEFILE.with_name("slurm")
BUNDLE = 900.0  # [s] of work that goes together at most; a job of more goes alone
# A cluster's processors may be slower, and are shared: what a job asks for, over its estimate
MARGIN_TIME, MARGIN_MEMORY = 3.0, 1.5
LEAST_MINUTES, LEAST_MB = 10, 500  # more than that, whatever is estimated
UNKNOWN_MINUTES, UNKNOWN_MB = 720, 2000
FAILED = "FAILED"  # Slurm's word for a job that ended with a code of its own

Bundles = dict[str, dict[str, Job]]


def run(jobs: Mapping[str, Job], folder: Path, profile: Path) -> list[Unmade]:
    """Does those of the jobs that are missing, whose files lie in `folder`; returns those that
    failed. Raises CaseError where a shell would read the name of a folder or the profile is none,
    and EngineError.
    """
    check(folder, profile)
    forget_done(folder)
    missing = {name: job for name, job in jobs.items() if not job.file.exists()}
    bundles = {
        bundle: inside
        for bundle, inside in bundled(jobs).items()
        if not missing.keys().isdisjoint(inside)
    }
    if not bundles:
        return []
    marks = folder / "bundles"
    for bundle in bundles:
        (marks / bundle).unlink(missing_ok=True)  # of an earlier call, whose files are gone
    text = text_of(bundles)
    file = folder / f"jobs-{hashlib.sha256(text.encode()).hexdigest()[:12]}.json"
    write_atomically(file, text)
    config = [f"jobs={file.name}", *(f"{key}={value}" for key, value in bounds(profile).items())]
    words = ["--snakefile", SNAKEFILE, "--config", *config, "--directory", folder]
    words += ["--profile", profile.resolve(), "--nolock", "--keep-going"]
    words += ["--rerun-incomplete", "--rerun-triggers", "mtime", "--quiet", "all"]
    began = time.time()
    done = call(
        module("snakemake", *words),
        cwd=ROOT,
        # Snakemake keeps a cache of its own, which it wants to write even without a home.
        env=os.environ | {"XDG_CACHE_HOME": str(user_cache(make=True))},
        stdout=subprocess.DEVNULL,
        start_new_session=True,  # it is ended with all its jobs (cases/children.py)
    )
    file.unlink(missing_ok=True)  # none is on the cluster any more
    undone = [name for name, job in missing.items() if not job.file.exists()]
    if not undone:
        return []
    logs = {name: folder / "logs" / f"{name}.log" for name in undone}
    told = ends(folder, began)
    failed = [name for name in undone if name in told or begun_since(logs[name], began)]
    if not failed:
        raise EngineError(f"snakemake: stopped ({refused(done.stderr)})")
    return [
        Unmade(told.get(name) or last_words(logs[name]) or f"{name}: ended without a word", log)
        for name, log in logs.items()
        if name in failed
    ]


def begun_since(log: Path, began: float) -> bool:
    return log.exists() and log.stat().st_mtime > began - 1.0


def bundled(jobs: Mapping[str, Job]) -> Bundles:
    """Jobs that are short, as estimated, and take one core, together; every other one alone."""
    out: Bundles = {}
    open_bundle, work = "", 0.0
    for name, job in jobs.items():
        if not 0.0 < job.seconds <= BUNDLE or job.cores > 1:
            out[name] = {name: job}
        elif open_bundle and work + job.seconds <= BUNDLE:
            out[open_bundle][name] = job
            work += job.seconds
        else:
            open_bundle, work = name, job.seconds
            out[name] = {name: job}
    return {
        first if len(inside) == 1 else f"{first}-and-{len(inside) - 1}": inside
        for first, inside in out.items()
    }


def minutes(bundle: Mapping[str, Job], factor: float) -> int:
    """What a bundle asks for at first."""
    if not all(job.seconds for job in bundle.values()):
        return ceil(factor * UNKNOWN_MINUTES)
    work = sum(job.seconds / job.cores for job in bundle.values())
    return ceil(factor * (LEAST_MINUTES + MARGIN_TIME * work / 60.0))


def megabytes(bundle: Mapping[str, Job], factor: float) -> int:
    """The same of memory."""
    most = max(job.bytes for job in bundle.values())
    if not most:
        return ceil(factor * UNKNOWN_MB)
    return ceil(factor * (LEAST_MB + MARGIN_MEMORY * most / 1e6))


def bounds(profile: Path) -> dict[str, float]:
    """What the profile's cluster.toml says of memory and time; the usual where it has none."""
    usual = {"memory_factor": 1.0, "time_factor": 1.0, "longest": 0.0}
    file = profile / "cluster.toml"
    try:
        told = tomllib.loads(file.read_text()) if file.exists() else {}
        found = {key: float(told.get(key, value)) for key, value in usual.items()}
    except (OSError, ValueError, TypeError) as error:
        raise CaseError(f"{file}: cannot be read ({error}) see {PROFILE / file.name}") from error
    for key, value in found.items():
        if not (0.0 < value < 1e6 or value == 0.0 and key == "longest"):
            raise CaseError(f"{file}: {key} = {value:g} (a positive number is wanted)")
    return found


def ends(folder: Path, began: float) -> dict[str, str]:
    """Why jobs failed that this call has handed in or found, by the records that the profile slurm
    keeps: their own words, or what ended them from outside.
    """
    out: dict[str, str] = {}
    files = (folder / "logs" / "slurm").glob("*.json")
    new = sorted((at, file) for file in files if (at := file.stat().st_mtime) > began - 1.0)
    for _, file in new:
        record = json.loads(file.read_text())
        how = (
            f"{record['state'].lower().replace('_', ' ')} at attempt {record['attempt']}, Slurm's "
            f"job {file.stem} of {record['minutes']} min and {record['memory']} MB"
        )
        for name in record["names"]:
            said = last_words(folder / "logs" / f"{name}.log") if record["state"] == FAILED else ""
            out[name] = said or f"{name}: {how}"
    return out


def refused(said: str) -> str:
    """The line that matters of what Snakemake has said: the cluster's own, or the last."""
    lines = [line.strip() for line in said.splitlines() if line.strip()] or ["it said nothing"]
    return next((line for line in lines if line.startswith("sbatch: ")), lines[-1])


def forget_done(folder: Path) -> None:
    """Removes the files of jobs that have all been done."""
    for file in folder.glob("jobs-*.json"):
        if all(job.file.exists() for inside in read(file).values() for job in inside.values()):
            file.unlink(missing_ok=True)


def check(folder: Path, profile: Path) -> None:
    """Raises CaseError or EngineError where no cluster can be told of the folder."""
    for path in (ROOT, folder.resolve(), profile.resolve()):
        if not plain(str(path)):
            raise CaseError(
                f"{path}: cannot be told to a cluster (a shell there would read its name) "
                f"work in a folder of plain letters, digits and {MARKS}"
            )
    if not (profile / "config.yaml").is_file():
        raise CaseError(
            f"{profile}: not a profile of Snakemake's (no config.yaml in it) "
            f"see {PROFILE.relative_to(ROOT)}"
        )
    if not importlib.util.find_spec("snakemake"):
        raise EngineError(
            "snakemake: no such program (not installed) install the package snakemake"
        )
