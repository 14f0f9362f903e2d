"""Explain the keys of input files, or such a file.

WORD is the start of a key (`grains`, `mpm.transfer`; all keys by default), or an input file, whose
complete values are shown. Scenes, element tests, paths of a material point and studies have keys of
their own: --kind.
"""

from cases import case
from cases.errors import CaseError
from cases.lookup import find_case
from cases.programs import call, program

TARGETS = ["mpm_case"]


def arguments(parser):
    parser.add_argument(
        "word", nargs="?", default="", metavar="WORD", help="start of a key, or an input file"
    )
    parser.add_argument(
        "--kind",
        choices=["scene", "element", "point", "study"],
        default="",
        help="kind of file (study for a study.toml, else scene)",
    )


def run(options) -> int:
    kind = ["--kind", options.kind] if options.kind else []
    if not options.word.startswith("-"):  # which mpm_case would take for an option
        keys = call([program("mpm_case"), "--describe", options.word, *kind])
        if keys.stdout:
            print(keys.stdout, end="")
            return 0
    try:
        path = find_case(options.word)
    except CaseError as error:
        words = str(error).removeprefix(f"{options.word}: ")
        raise CaseError(f"{options.word}: no key starts so, and there is {words}") from error
    print(case.load(path, kind=options.kind).resolved, end="")
    return 0
