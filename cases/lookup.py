"""Cases by what a user calls them."""

import difflib
import os
from pathlib import Path

from cases.errors import CaseError
from cases.programs import ROOT


def find_case(name: str) -> Path:
    """`name` as a path if there is one, else the folder of that name in cases/.

    Raises CaseError for a word that is neither.
    """
    named = ROOT / "cases" / name
    if os.path.lexists(name) or "/" in name or name.endswith(".toml"):
        return Path(name)
    known = sorted(file.parent.name for file in (ROOT / "cases").glob("*/case.toml"))
    if name not in known:
        near = difflib.get_close_matches(name, known, 1)
        hint = f" Did you mean '{near[0]}'?" if near else ""
        raise CaseError(f"{name}: no such case (known: {', '.join(known)}).{hint}")
    return Path(os.path.relpath(named)) if named.is_relative_to(Path.cwd()) else named
