"""What is known of the jobs handed to Slurm: a file each, <number>.json in logs/slurm of the folder
that Snakemake works in.

The keys: bundle (what Snakemake calls the job), names (of our jobs in it), attempt, memory [MB],
minutes, state (Slurm's last word, or WITHDRAWN by us). Snakemake is told <number>:<bundle>.
"""

import json
import os
from pathlib import Path

FOLDER = Path("logs/slurm")
WITHDRAWN = "WITHDRAWN"


def file_of(number: str) -> Path:
    return FOLDER / f"{number}.json"


def read(number: str) -> dict:
    """Nothing where it is not known."""
    try:
        return json.loads(file_of(number).read_text())
    except (OSError, ValueError):
        return {}


def write(number: str, record: dict) -> None:
    """On the disk before it has its name: a machine may lose power."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    part = FOLDER / f".{number}.{os.getpid()}"
    with part.open("w") as file:
        file.write(json.dumps(record) + "\n")
        file.flush()
        os.fsync(file.fileno())
    part.replace(file_of(number))


def newest_of(bundle: str) -> dict:
    """Record of the latest attempt at what Snakemake calls so; nothing if there is none."""
    found = sorted(FOLDER.glob("[0-9]*.json"), key=lambda file: -file.stat().st_mtime_ns)
    records = (read(file.stem) for file in found)
    return next((one for one in records if one.get("bundle") == bundle), {})


def are_there() -> bool:
    """Whether Slurm has taken a job of this folder before."""
    return any(FOLDER.glob("[0-9]*.json"))


def name_of(bundle: str) -> str:
    """What Slurm calls it."""
    return f"grainpair-{bundle}"


def told(name: str) -> tuple[str, str]:
    """Number and bundle of a job by what Snakemake was told of it."""
    number, _, bundle = name.partition(":")
    return number, bundle or read(number).get("bundle", "")


def is_here(folder: str) -> bool:
    """Whether it is the folder that Snakemake works in, by whatever path."""
    try:
        return os.path.samefile(folder, ".")
    except OSError:
        return False
