"""What [Ceccato2019] says of its column, measured: its figures and statements from a run of the
continuum, to rest.

RUN is an mpm.h5, a folder that holds one, or a case, whose continuum is then run first. Written to
--out: collapse.html, figures/, statements.json, fields.h5.
"""

import sys
from pathlib import Path

import pandas as pd

from cases import case, command_line, cost, files, results
from compare.report import collapse
from cases.lookup import find_case
from cases.scenes import refuse_chute
from cases.stages import Stage, run_stages
from cases.errors import CaseError
from cases.files import write_table
from cases.programs import ROOT, name_of, program
from compare.mapping.runs import open_run

PACKAGES = ["studies"]


def arguments(parser):
    parser.add_argument(
        "run_or_case",
        nargs="?",
        default="column_full",
        metavar="RUN",
        help="mpm.h5, folder that holds one, or case (%(default)s)",
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder of the results (collapse/ beside the mpm.h5; of a case, runs/collapse/<case>)",
    )
    command_line.add_overrides(parser)
    parser.add_argument(
        "--threads", type=command_line.threads, default=1, help="of the continuum (%(default)s)"
    )
    parser.add_argument(
        "--table", type=Path, metavar="FILE", help="also keep the statements as CSV"
    )
    parser.add_argument("--quiet", action="store_true", help="show no progress")


def run(options) -> int:
    given = Path(options.run_or_case)
    path = given if given.suffix == ".h5" else given / "mpm.h5"
    if not path.exists():
        if given.suffix == ".h5":
            raise CaseError(f"{given}: no such file")
        return alone(options)
    if options.overrides:
        raise CaseError(f"{path}: --set has no effect on a run that is there give a case instead")
    if options.table:
        files.check_table(options.table)
    out = options.out or path.parent / "collapse"
    # In the folder of a run it lies among what that folder's owner moves.
    ours = ["figures" if options.out else "collapse/figures"]
    with results.prepared(options.out or path.parent, ours) as work:
        statements = show(path, work if options.out else work / "collapse", options)
    say(statements, out)
    return 0


def alone(options) -> int:
    """Runs the continuum of a case, and shows it."""
    scene = case.load(find_case(options.run_or_case), options.overrides)
    refuse_chute(scene, "statements are")
    case.tell_contradictions(scene)
    out = options.out or Path("runs") / "collapse" / name_of(scene.path)
    if options.table:
        files.check_table(options.table)
    with results.owned(out, cost.continuum(scene).disk) as folder, folder.prepare(
        ["figures"]
    ) as work:
        path = solve(scene, options, work)
        with folder.rescued(work, "not-shown"):
            statements = show(path, work, options)
    say(statements, out)
    return 0


def show(path: Path, folder: Path, options) -> dict:
    """Makes page, figures and statements of a run in a folder."""

    def tell(fraction: float, text: str) -> None:
        if not options.quiet:
            print(f"{100 * fraction:3.0f} % {text}", file=sys.stderr, flush=True)

    statements = collapse.make(path, folder, tell)
    if options.table:
        keep(statements, path, options.table)
    return statements


def say(statements: dict, out: Path):
    for name, s in statements.items():
        figure = "-" if s["figure"] is None else f"{s['figure']:.4g}"
        print(f"{s['verdict']:<14} {name:<34} {figure:>9} {s['unit']:<36} {s['bound']}")
    print(
        f"numerical loss {100 * statements['kinetic_energy_vanishes']['numerical_loss']:.2f} % of "
        "the energy released"
    )
    print(out / "collapse.html")


def solve(scene: case.Case, options, out: Path) -> Path:
    """mpm.h5 of a case, in the results' folder."""
    sets = [word for assignment in options.overrides for word in ("--set", assignment)]
    words = [
        program("mpm_run"),
        scene.path,
        *sets,
        "--progress",
        "--threads",
        options.threads,
        "-o",
        out / "mpm.h5",
    ]
    run_stages([Stage("continuum (MPM)", words)], quiet=options.quiet)
    return out / "mpm.h5"


def keep(statements: dict, path: Path, file: Path):
    """The statements as CSV below comment lines that say which run they are of."""
    attributes = open_run(path).attributes
    rows = [
        {"statement": name}
        | {
            key: s[key]
            for key in ("figure", "unit", "bound", "verdict", "until", "numerical_loss", "words")
        }
        for name, s in statements.items()
    ]
    command = attributes["command"].replace(
        f"{ROOT}/", ""
    )  # as a user in the project's folder types it
    head = [
        f"command: {command}; ./grainpair collapse",
        f"commit: {attributes['commit']}  date: {attributes['date']}",
        f"{attributes['cpu_seconds']:.0f} s of processor time, ended by: "
        f"{attributes['end_reason']}; warnings: {attributes.get('warnings', 'none')}",
        "until [sqrt(H/g)]: when the figure is decided; numerical_loss: by then, over the energy "
        "released",
    ]
    write_table(file, head, pd.DataFrame(rows))
