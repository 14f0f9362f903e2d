"""What was measured: one CSV row per point, with how it was made in the header."""

import csv
import os
import platform
from pathlib import Path

from compare.element.case import Case

Rows = list[dict]
TEXT = ("status", "commit", "machine")


def reference_file(case: Case) -> Path:
    """Where the rows of all points of a case are kept."""
    return case.folder / "reference" / f"{case.test}.csv"


def measured(case: Case) -> Rows:
    """The rows of the case's reference whose point could be measured."""
    return [row for row in read(reference_file(case)) if row["status"] == "measured"]


def machine() -> str:
    """Processor and system, in words."""
    names = [
        line.split(":")[1].strip()
        for line in Path("/proc/cpuinfo").read_text().splitlines()
        if line.startswith("model name")
    ]
    return (
        f"{names[0] if names else platform.processor()}, {platform.system()} {platform.release()}"
    )


def read(path: Path) -> Rows:
    """The rows of a record file as dicts, numbers as floats; no file, no rows."""
    if not path.exists():
        return []
    with path.open() as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        return [
            {key: value if key in TEXT else float(value or "nan") for key, value in row.items()}
            for row in rows
        ]


def write(path: Path, rows: Rows, command: str) -> None:
    """Writes rows with their header (atomically): command, commits, machine, seeds."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    with part.open("w", newline="") as file:
        for name, value in (
            ("command", command),
            ("commit", "the column commit; + means with local changes"),
            ("machine", "; ".join(sorted({row["machine"] for row in rows}))),
            ("seeds", sorted({int(row["seed"]) for row in rows})),
        ):
            file.write(f"# {name}: {value}\n")
        table = csv.DictWriter(file, columns, lineterminator="\n")
        table.writeheader()
        table.writerows(
            {k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows
        )
    os.replace(part, path)
