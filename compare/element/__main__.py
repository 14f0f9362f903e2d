"""python3 -m compare.element CASE [--point NAME] [--gather]

Runs what the case's reference lacks, one point or all. A point's record is written to
build/element/<test>/ and gathered into CASE/reference/<test>.csv; a killed campaign goes on where
it stopped.
"""

import argparse
import sys
from pathlib import Path

from cases.command_line import Parser
from cases.errors import CaseError, EngineError
from compare.element import campaign
from compare.element.case import Case


def main() -> int:
    parser = Parser(
        prog="compare.element",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("case", type=Path)
    parser.add_argument("--point", help="the one point to run, by name; its record is not gathered")
    parser.add_argument("--gather", action="store_true", help="only gather the records that wait")
    arguments = parser.parse_args()
    command = f"python3 -m compare.element {arguments.case}"
    try:
        case = Case(arguments.case)
        named = {campaign.name_of(case, point): point for point in campaign.points(case)}
        if arguments.point and arguments.point not in named:
            raise CaseError(
                f"{case.path}: no point '{arguments.point}' (one of {', '.join(named)} expected)"
            )
    except (CaseError, EngineError) as error:
        print(error, file=sys.stderr)
        return 2 if isinstance(error, CaseError) else 3
    if arguments.point:
        campaign.store_point(case, named[arguments.point])
        return 0
    if not arguments.gather:
        for point in campaign.missing(case):
            if not campaign.record_file(case, point).exists():
                campaign.store_point(case, point)
            campaign.gather(case, command)
            print(campaign.name_of(case, point), flush=True)
    campaign.gather(case, command)
    return 0


if __name__ == "__main__":
    sys.exit(main())
