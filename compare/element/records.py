"""What was measured: one CSV row per point, with how it was made in the header."""

import csv
import platform
from pathlib import Path

from cases.files import write_table
from cases.provenance import head, processor
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
    return f"{processor()}, {platform.system()} {platform.release()}"


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
    """Writes rows below the command, the commits, the machines and the seeds that they are of."""
    origin = {
        "command": command,
        "commit": "the column commit; + means with local changes",
        "machine": "; ".join(sorted({row["machine"] for row in rows})),
        "seeds": str(sorted({int(row["seed"]) for row in rows})),
    }
    write_table(path, head(origin), rows, "%.6g")
