"""The two ways a command fails; the launcher prints the line and exits with the code.

A failure that somebody tells from others carries a code, which ends its line in brackets: the
message may be reworded, the code stays. The codes are those of cases/failure.hpp, which
`mpm_case --failures` prints; a test compares the two.
"""

import sys
from collections.abc import Callable
from enum import StrEnum


class Failure(StrEnum):
    """Why an engine could not go on."""

    NOT_FINITE = "not-finite"
    ENERGY_GROWTH = "energy-growth"
    EJECTED = "ejected"
    INVERTED = "inverted"
    UNATTAINABLE = "unattainable"
    LOST_GRAINS = "lost-grains"
    REFUSED = "refused"
    LIBRARY = "library"
    CPU_LIMIT = "cpu-limit"


class Warned(StrEnum):
    """What spoils a result without ending its run; the first word of a warning's line."""

    DRIFT = "drift"
    HALVED = "halved"
    NOISE = "noise"
    LOCKING = "locking"
    CROWDING = "crowding"
    LOSS = "loss"
    TENSION = "tension"
    END = "end"
    ESTIMATED = "estimated"


def code_of(line: str) -> Failure | None:
    """The code that ends a line, such as a program's last word on standard error."""
    return next((code for code in Failure if line.endswith(f" [{code}]")), None)


def printable(text: str) -> str:
    """Text as one line that shows all of it: what cannot be printed, a line's end too, escaped."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


class Failed(Exception):
    """A line, and the code that ends it; of a child's line the code is read."""

    def __init__(self, line: str, code: Failure | None = None):
        line = printable(line.strip())
        super().__init__(f"{line} [{code}]" if code else line)
        self.code = code or code_of(line)


class CaseError(Failed):
    """Bad input, said in one line: `file:line: problem (why) hint`. Exit code 2."""


class EngineError(Failed):
    """A program of a run failed or is missing, said in one line. Exit code 3."""


def exit_code(main: Callable[[], int]) -> int:
    """What a program ends with: the code of `main`, or of its failure, said in one line."""
    try:
        return main()
    except CaseError as error:
        print(error, file=sys.stderr)
        return 2
    except EngineError as error:
        print(error, file=sys.stderr)
        return 3
