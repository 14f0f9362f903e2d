"""The writers of every file that is kept: it appears complete or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path beside `path`, of the same suffix, that takes its place once the block has ended well;
    makes the folder.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.stem}-{os.getpid()}.part{path.suffix}")
    try:
        yield part
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def write_atomically(path: Path, text: str):
    with replacing(path) as part:
        part.write_text(text)


def write_figure(path: Path, figure, **options):
    """A matplotlib figure in the format of the path's suffix; `options` are savefig's."""
    with replacing(path) as part:
        figure.savefig(part, **options)


def write_table(
    path: Path,
    head: Iterable[str],
    table: pd.DataFrame | list[dict],
    float_format: str = "%.4g",
):
    """A table as CSV below comment lines, which say where it comes from (cases/provenance.py)."""
    import pandas as pd  # takes its time to load, which most who write a file need not wait for

    write_atomically(
        path,
        "".join(f"# {line}\n" for line in head)
        + pd.DataFrame(table).to_csv(index=False, float_format=float_format),
    )
