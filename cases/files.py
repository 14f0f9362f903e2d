"""Text files that appear complete or not at all."""

import os
from pathlib import Path

import pandas as pd


def write_atomically(path: Path, text: str):
    part = path.with_name(path.name + ".part")
    part.write_text(text)
    os.replace(part, path)


def write_table(path: Path, head: list[str], table: pd.DataFrame, float_format: str = "%.4g"):
    """A table as CSV below comment lines, which say where it comes from; makes the folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(
        path,
        "".join(f"# {line}\n" for line in head)
        + table.to_csv(index=False, float_format=float_format),
    )
