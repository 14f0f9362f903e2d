"""Where the compiled programs are."""

import os
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def program(name: str) -> Path:
    """Path of a compiled program: in $GRAINPAIR_BUILD, or in build/release of this clone."""
    return Path(os.environ.get("GRAINPAIR_BUILD", ROOT / "build" / "release")) / name
