"""Results by their path."""

import os
from pathlib import Path

from grainpair.pair import Pair
from grainpair.result import Result


def open(path: str | os.PathLike) -> Pair | Result:
    """A folder of a run as a Pair, a result file of either engine as a Result.

    Raises CaseError where it is neither. Arrays are read when they are asked for.
    """
    return Pair(Path(path)) if os.path.isdir(path) else Result(Path(path))
