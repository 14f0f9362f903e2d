"""Compare runs anew from their files: fields, metrics, figures, report.

Each RUN is a folder that holds mpm.h5 and dem.h5; further files mpm*.h5 and dem*.h5 in it (other
seeds, other point jitter) make it an ensemble, whose scatter the verdicts use. With --dump the
grains of one folder are those of another program (as grainpair import takes them), of a scene that
--case describes. New results take the place of the old ones once all are complete.
"""

import sys
from pathlib import Path

from cases import case, files, results
from cases.errors import CaseError
from cases.provenance import typed
from compare.importing import options as importing
from compare.importing.pipeline import convert
from cases.scenes import refuse_chute
from compare.mapping.runs import open_run
from compare.report import report
from compare.verdict import comparison, conclusion, controls, siblings, verdict_table

PACKAGES = {"--dump": ["studies"]}
WIDTHS = (0.25, 0.35, 0.5, 0.6, 0.75, 0.9, 1.0, 1.25, 1.5, 2.0)


def arguments(parser):
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="folder of a run")
    parser.add_argument("--width", type=float, help="kernel width in grain diameters (the case's)")
    parser.add_argument(
        "--kernel", choices=["gauss", "lucy", "heaviside", "linear"], help="kernel (the case's)"
    )
    parser.add_argument(
        "--spacing", type=float, help="spacing of the mapped grid in grain diameters (the case's)"
    )
    parser.add_argument(
        "--width-study",
        action="store_true",
        help="map the grains with a range of widths too, and show what each field makes of it",
    )
    parser.add_argument(
        "--controls",
        action="store_true",
        help="also run the negative controls that a folder lacks: over-frictional continuum, "
        "other column",
    )
    parser.add_argument(
        "--siblings",
        action="store_true",
        help="also run the two cheap runs that tell the continuum's numerical error, where a "
        "folder lacks them",
    )
    parser.add_argument(
        "--table", type=Path, metavar="FILE", help="also keep the verdicts as CSV; with one RUN"
    )
    parser.add_argument(
        "--dump",
        nargs="+",
        type=Path,
        metavar="FILE",
        help="files of another program to make dem.h5 of, in any order",
    )
    parser.add_argument(
        "--replace",
        action="store_true",
        help="with --dump: also replace a dem.h5 that is the result of a run",
    )
    parser.add_argument("--quiet", action="store_true", help="show no progress")
    importing.arguments(parser)
    conclusion.require_argument(parser)


def run(options) -> int:
    names = conclusion.required(options.require)
    if options.dump and (len(options.runs) != 1 or not options.case):
        raise CaseError("grainpair compare: --dump needs one RUN and --case")
    if options.table and len(options.runs) != 1:
        raise CaseError("grainpair compare: --table needs one RUN")
    if options.table:
        files.check_table(options.table)
    scene = case.load(options.case) if options.dump else None
    words = importing.Options.of(options.dump, options) if options.dump else None
    code = 0
    for folder in options.runs:
        if not folder.is_dir():
            raise CaseError(f"{folder}: no folder of a run. Make one with: grainpair run")
        with results.owned(folder) as owned:
            metrics = renew(owned, options, scene, words)
        for line in conclusion.lines(metrics):
            print(f"{folder}: {line}" if line.startswith("verdict:") else line)
        for line in conclusion.not_met(metrics, names):
            print(f"{folder}: {line}", file=sys.stderr)
        print(folder / "report.html")
        code = code or conclusion.exit_code(metrics, names)
    return code


def renew(
    folder: results.Folder,
    options,
    scene: case.Case | None,
    words: importing.Options | None,
) -> dict:
    """Makes what a comparison makes, and puts it into the folder when all of it is there; `words`
    say what grains of another program to take, of the `scene`.
    """
    mapping = [
        word
        for key in ("width", "kernel", "spacing")
        if (value := getattr(options, key))
        for word in (f"--{key}", str(value))
    ]
    if not scene:
        with folder.prepare(borrow=report.INPUTS) as work:  # stay, whatever the comparison comes to
            make_missing(work, options)
    if scene:
        refuse_to_lose(folder.out / "dem.h5", options.replace)

    def say(fraction: float, text: str) -> None:
        if not options.quiet:
            print(f"{folder.out}: {100 * fraction:.0f} % {text}", flush=True)

    with folder.prepare(report.OUTPUTS, report.INPUTS) as work:
        if words:
            (work / "dem.h5").unlink(missing_ok=True)  # a link to the one that is there
            convert(words, scene, work / "dem.h5", options.quiet)
        runs = [open_run(path) for engine in comparison.run_files(work) for path in engine]
        comparison.refuse_unpaired(runs)
        if scene:
            make_missing(work, options)
        metrics = report.compare(work, mapping, say, WIDTHS if options.width_study else ())
        if options.table:
            command = typed("./grainpair", sys.argv[1:])
            verdict_table.write(metrics, runs, options.table, command)
    return metrics


def refuse_to_lose(file: Path, replace: bool):
    """Raises CaseError where imported grains would take the place of those that were run."""
    if replace or not file.exists():
        return
    try:
        run = open_run(file)
        imported, made_by = run.imported, run.attributes.get("engine_version", "an unknown engine")
    except CaseError:
        imported, made_by = False, "a program that is not known"
    if not imported:
        raise CaseError(
            f"{file}: is there, and not imported but made by {made_by} (it would be lost) give "
            "another folder, or --replace"
        )


def make_missing(work: Path, options):
    """Runs the controls and siblings that are asked for and that the folder lacks."""
    mpm, dem = comparison.run_files(work)
    if options.controls or options.siblings:
        refuse_chute(open_run(mpm[0]).case, "controls and siblings are")
    if options.controls:
        controls.make(work, open_run(mpm[0]), open_run(dem[0]), options.quiet)
    if options.siblings:
        siblings.make(work, open_run(mpm[0]), dem[0], options.quiet)
