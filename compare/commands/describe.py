"""Explain the keys of case files, or a case.

WORD is the start of a key (`grains`, `mpm.transfer`; all keys by default), or a case, whose
complete values are shown.
"""

import subprocess

from cases import case
from compare.commands.run import find_case
from cases.programs import program

TARGETS = ["mpm_case"]


def arguments(parser):
    parser.add_argument(
        "word", nargs="?", default="", metavar="WORD", help="start of a key, or a case"
    )


def run(options) -> int:
    keys = subprocess.run(
        [program("mpm_case"), "--describe", options.word],
        capture_output=True,
        text=True,
        check=True,
    )
    if keys.stdout:
        print(keys.stdout, end="")
    else:
        print(case.load(find_case(options.word)).resolved, end="")
    return 0
