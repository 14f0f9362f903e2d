"""Where the compiled programs are, and where results are kept for other runs."""

import os
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def program(name: str) -> Path:
    """Path of a compiled program: in $GRAINPAIR_BUILD, or in build/release of this clone."""
    return Path(os.environ.get("GRAINPAIR_BUILD", ROOT / "build" / "release")) / name


def kept(*words: str) -> Path:
    """A folder of results that are kept for other runs: in $GRAINPAIR_RUNS, or in runs of this
    clone.
    """
    return Path(os.environ.get("GRAINPAIR_RUNS", ROOT / "runs")).resolve().joinpath(*words)


def short(path: Path) -> Path:
    """A path as a user in the project's folder types it."""
    path = path.resolve()
    return path.relative_to(ROOT) if path.is_relative_to(ROOT) else path


def name_of(case: Path) -> str:
    """What a case is called: its folder's name, or its file's when that is not case.toml."""
    case = case.resolve()
    return case.parent.name if case.name == "case.toml" else case.stem
