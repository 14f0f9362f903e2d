"""grainpair runs a granular scene as a continuum and grain by grain, and compares the two.

compare/parsers.py finds the commands; compare/targets.py says what each needs built.
"""

import sys
import tempfile
from pathlib import Path

from cases import room
from cases.errors import CaseError, exit_code
from compare.parsers import parser_for, refuse_unknown


def done(options) -> int:
    """Does it. Where room runs out and nobody else has said for what, it is for temporary files."""
    with room.enough(Path(tempfile.gettempdir())):
        return options.run(options)


def main(words: list[str]) -> int:
    try:
        refuse_unknown(words)
    except CaseError as error:
        print(error, file=sys.stderr)
        return 2
    parser = parser_for(words)
    if not words:
        parser.print_help()
        return 2
    options = parser.parse_args(words)
    try:
        return exit_code(lambda: done(options))
    except KeyboardInterrupt:
        print("grainpair: interrupted", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
