"""Cases by what a user calls them."""

import difflib
import os
from collections.abc import Iterable
from pathlib import Path

from cases.errors import CaseError
from cases.programs import ROOT


def meant(word: str, known: Iterable[str]) -> str:
    """ " Did you mean 'run'?", of the known word that is nearest to another; "" where none is."""
    near = difflib.get_close_matches(word, list(known), 1)
    return f" Did you mean '{near[0]}'?" if near else ""


def cases_in(folder: Path) -> list[str]:
    """The names of the folders in a folder that hold a case.toml."""
    return sorted(file.parent.name for file in folder.glob("*/case.toml"))


def find_case(name: str) -> Path:
    """`name` as a path if there is one, else the folder of that name in cases/.

    Raises CaseError for a word that is neither, and for a path that is not there but close to a
    case that is.
    """
    if os.path.lexists(name) or "/" in name or name.endswith(".toml"):
        refuse_misspelt(Path(name))
        return Path(name)
    known, named = cases_in(ROOT / "cases"), ROOT / "cases" / name
    if name not in known:
        hint = meant(name, known)
        raise CaseError(f"{name}: no such case (known: {', '.join(known)}).{hint}")
    return Path(os.path.relpath(named)) if named.is_relative_to(Path.cwd()) else named


def refuse_misspelt(path: Path):
    """Raises CaseError for a path that is not there where one beside it is a case and near."""
    folder = path.parent if path.suffix == ".toml" else path
    if os.path.lexists(folder) or not folder.name:
        return
    if hint := meant(folder.name, cases_in(folder.parent)):
        raise CaseError(f"{path}: no such case.{hint}")
