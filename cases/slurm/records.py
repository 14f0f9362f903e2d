"""What is known of the jobs handed to Slurm: a file each, <number>.json in logs/slurm of the folder
that Snakemake works in.

The keys: bundle (what Snakemake calls the job), names (of our jobs in it), attempt, memory [MB],
minutes, state (Slurm's last word, or WITHDRAWN by us).
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
    FOLDER.mkdir(parents=True, exist_ok=True)
    part = FOLDER / f".{number}.{os.getpid()}"
    part.write_text(json.dumps(record) + "\n")
    part.replace(file_of(number))


def newest_of(bundle: str) -> tuple[str, dict]:
    """Number and record of the latest attempt at what Snakemake calls so; "" if there is none."""
    found = sorted(FOLDER.glob("[0-9]*.json"), key=lambda file: -file.stat().st_mtime_ns)
    records = ((file.stem, read(file.stem)) for file in found)
    return next(((number, one) for number, one in records if one.get("bundle") == bundle), ("", {}))
