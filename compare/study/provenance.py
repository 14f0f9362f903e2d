"""Where study data come from, for the head of every table."""

import datetime
import platform

import pandas as pd

from cases.files import write_table
from dem_reference.ensemble import processor
from dem_reference.output import commit as head


def about(command: str, **more) -> dict:
    today = datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d")
    return {
        "command": command,
        "commit": head(),
        "date": today,
        "machine": f"{platform.machine()}, {processor()}",
    } | more


def save(table: pd.DataFrame, path, origin: dict, note: str):
    """A table as CSV below comment lines that say where it comes from."""
    write_table(path, [f"{name}: {value}" for name, value in origin.items()] + [note], table)
