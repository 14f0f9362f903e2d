"""One seed of an ensemble: python3 -m dem_reference.member CONFIG SEED, in the ensemble's folder;
writes SEED.h5 there.

CONFIG holds the case, its assignments and the ranks (dem_reference/ensemble.py).
"""

import json
import os
import sys
from pathlib import Path

from cases.programs import ROOT, short
from dem_reference import run


def main() -> int:
    config = json.loads(Path(sys.argv[1]).read_text())
    result = short(Path(f"{sys.argv[2]}.h5"))
    os.chdir(ROOT)  # so that the result's command is one that a user there can give
    sets = [word for assignment in config["set"] for word in ("--set", assignment)]
    words = [config["case"], "-o", result, "--seed", sys.argv[2], *sets]
    return run.main([str(word) for word in [*words, "--ranks", config["ranks"], "--quiet"]])


if __name__ == "__main__":
    sys.exit(main())
