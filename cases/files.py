"""The writers of every file that is kept: it appears complete or not at all."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from cases import room
from cases.errors import CaseError, printable
from cases.scratch import locked, made_folders, named, scratch, told

if TYPE_CHECKING:
    import pandas as pd


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path of the same name, in a folder of its own beside `path`, that takes its place once the
    block has ended well; makes the folder. Raises CaseError where nothing can be written there.
    """
    with told(path), made_folders(path.parent):
        refuse_folder(path)
        with scratch(path.parent, path.name) as work:
            part = work / path.name
            yield part
            put(part, path)


@contextmanager
def owned(
    path: Path, needs: float = 0.0, after: Callable[[], None] = lambda: None
) -> Iterator[Path]:
    """The same, by one process at a time: for what takes long. `after` is called when the file is
    there, before anybody else may have it. Raises EngineError where it `needs` more room than there
    is [bytes].
    """
    with told(path):
        room.refuse_lack(path, needs)
    with ExitStack() as stack:
        stack.enter_context(room.enough(path, needs))
        with told(path):
            stack.enter_context(made_folders(path.parent))
            stack.enter_context(locked(path.with_name(f".{path.name}.lock"), path))
            refuse_folder(path)
            work = stack.enter_context(scratch(path.parent, path.name))
        part = work / path.name
        with named(work, path):
            yield part
        with told(path):
            put(part, path)
            after()


def put(part: Path, path: Path):
    """Gives a complete file its name. Raises OSError."""
    room.settle(part)
    os.replace(part, path)


def refuse_folder(path: Path):
    if path.is_dir():
        raise CaseError(f"{path}: cannot be written (it is a folder) give the name of a file")


def check(path: Path):
    """Raises CaseError where no file can be written at `path`: before what takes long to make it.
    Makes nothing but its folder.
    """
    with told(path), made_folders(path.parent):
        refuse_folder(path)
        with scratch(path.parent, path.name):
            pass


def check_figure(path: Path):
    """The same of a figure, in a format that write_figure knows."""
    from matplotlib.figure import Figure  # takes its time to load

    known = sorted(Figure().canvas.get_supported_filetypes())
    if path.suffix[1:] not in known:
        raise CaseError(
            f"{path}: no figure can be of that name give it one of .{', .'.join(known)}"
        )
    check(path)


def check_table(path: Path):
    """The same of a table, which takes the place of no file but an earlier table."""
    check(path)
    if path.exists() and not path.read_bytes().startswith(b"# "):
        raise CaseError(
            f"{path}: is there, and no table of grainpair (it would be lost) give another name"
        )


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
        "".join(f"# {printable(line)}\n" for line in head)
        + pd.DataFrame(table).to_csv(index=False, float_format=float_format),
    )
