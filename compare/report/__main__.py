"""python3 -m compare.report RUNDIR."""

import sys

from cases.errors import exit_code
from compare.report.report import main

if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(sys.argv[1:])))
