"""python3 -m compare.report RUNDIR."""

import sys

from compare.report.report import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
