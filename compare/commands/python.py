"""Start Debian's Python with this clone on its path: `import grainpair` works there.

Words are Python's own: a script and its arguments, -c, -m; none starts it by hand. docs/python.md
says what the package has.
"""

import argparse
import os

from cases.programs import PYTHON, ROOT


def arguments(parser):
    parser.prefix_chars = ""  # options are Python's
    parser.add_argument("words", nargs=argparse.REMAINDER, metavar="ARG", help="Python's own words")


def run(options) -> int:
    if options.words in (["-h"], ["--help"]):
        print(__doc__.strip())
        return 0
    around = os.environ | {"PYTHONPATH": str(ROOT / "compare" / "python")}
    os.execve(PYTHON, [PYTHON, "-X", "utf8", *options.words], around)
