"""Where study data come from, for the head of every table."""

import datetime
import platform

import pandas as pd

from compare.report import write_atomically
from dem_reference.ensemble import processor
from dem_reference.output import commit as head


def about(command: str, **more) -> dict:
    today = datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d")
    return {"command": command, "commit": head(), "date": today, "machine": f"{platform.machine()}, {processor()}"} | more


def save(table: pd.DataFrame, path, origin: dict, note: str):
    """A table as CSV below comment lines that say where it comes from."""
    path.parent.mkdir(parents=True, exist_ok=True)
    header = [f"{name}: {value}" for name, value in origin.items()] + [note]
    write_atomically(path, "".join(f"# {line}\n" for line in header) + table.to_csv(index=False, float_format="%.4g"))
