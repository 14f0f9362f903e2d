"""Command lines of the programs in Python: a mistake is one line, and counts have the bounds that
the programs in C++ give them (cases/command_line.hpp).
"""

import argparse
from collections.abc import Callable

from cases.errors import printable

MOST_THREADS = 1024  # also of ranks and of jobs at a time
MOST_SEED = 2**32 - 1


class Parser(argparse.ArgumentParser):
    """argparse's, which would put its usage above a mistake."""

    def error(self, message: str):
        line = printable(" ".join(message.split()).removeprefix("argument "))
        self.exit(2, f"{self.prog}: {line} (see --help)\n")


def add_overrides(parser: argparse.ArgumentParser):
    """--set KEY=VALUE of a case, any number of times: a list, `overrides`."""
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        dest="overrides",
        help="overrides a key of the case; may be repeated",
    )


def whole(low: int, high: int) -> Callable[[str], int]:
    """The type of an option that takes a whole number from `low` to `high`."""

    def number(word: str) -> int:
        digits = word.removeprefix("-")
        readable = digits.isascii() and digits.isdigit() and len(digits) < 20
        if not readable or not low <= int(word) <= high:
            raise argparse.ArgumentTypeError(f"{word} is no whole number from {low} to {high}")
        return int(word)

    return number


threads = whole(1, MOST_THREADS)
seed = whole(0, MOST_SEED)
several = whole(1, 10_000)  # seeds, runs
