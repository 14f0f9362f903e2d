"""grainpair from Python: start a run, open one, have its numbers.

    import grainpair

    pair = grainpair.run("column_ci", out="runs/mine", sets={"grains.friction": 0.4})
    pair = grainpair.open("runs/mine")          # of both engines: a Pair
    side = grainpair.open("runs/mine/dem.h5")   # of one: a Result

    pair.dem.frames[-1]["position"]             # array (N, 3) [m]
    pair.mpm.history["kinetic"]                 # series over time [J]
    pair.verdicts                               # table, as metrics.json has them

Nothing is done here that the project does not do elsewhere: runs are those of the command
`grainpair run`, files are read and figures computed by the modules of the clone. What is wrong is
told in one line, as CaseError (bad input) or EngineError (a program failed, or a package is
missing).
"""

import sys
from pathlib import Path

_CLONE = Path(__file__).resolve().parents[3]
if str(_CLONE) not in sys.path:
    sys.path.append(str(_CLONE))  # behind the user's own modules
import cases  # noqa: E402

if Path(str(cases.__file__)).resolve().parents[1] != _CLONE:
    raise ImportError(
        f"grainpair: a module of yours is called cases ({cases.__file__}), as one of {_CLONE} is; "
        "rename it, or work in another folder"
    )

from cases.errors import CaseError, EngineError  # noqa: E402
from grainpair.opening import open  # noqa: E402
from grainpair.pair import Pair  # noqa: E402
from grainpair.result import Contacts, Frame, Result  # noqa: E402
from grainpair.starting import run  # noqa: E402

__all__ = ["CaseError", "Contacts", "EngineError", "Frame", "Pair", "Result", "open", "run"]
