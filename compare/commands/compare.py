"""Compare runs anew from their files: fields, metrics, figures, report.

Each RUN is a folder that holds mpm.h5 and dem.h5; further files mpm*.h5 and dem*.h5 in it (other
seeds, other point jitter) make it an ensemble, whose scatter the verdicts use. With --dump the
grains of one folder are read from plain LIGGGHTS or LAMMPS dumps instead, of a scene that --case
describes.
"""

import sys
from pathlib import Path

from cases import case
from cases.errors import CaseError
from compare.mapping import dumps
from compare.mapping.runs import open_run
from compare.report import report
from compare.verdict import comparison, conclusion, controls, verdict_table

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
        "--table", type=Path, metavar="FILE", help="also keep the verdicts as CSV; with one RUN"
    )
    parser.add_argument(
        "--dump", nargs="+", type=Path, metavar="FILE", help="dumps to make dem.h5 of, in any order"
    )
    parser.add_argument("--case", type=Path, help="case file of the dumped grains")
    parser.add_argument(
        "--time-step", type=float, metavar="S", help="time step of the dumped run [s]"
    )
    parser.add_argument("--quiet", action="store_true", help="show no progress")
    conclusion.require_argument(parser)


def run(options) -> int:
    names = conclusion.required(options.require)
    if options.dump:
        if len(options.runs) != 1 or not options.case or not options.time_step:
            raise CaseError("grainpair compare: --dump needs one RUN, --case and --time-step")
        options.runs[0].mkdir(parents=True, exist_ok=True)
        dumps.convert(
            options.dump, case.load(options.case), options.time_step, options.runs[0] / "dem.h5"
        )
    if options.table and len(options.runs) != 1:
        raise CaseError("grainpair compare: --table needs one RUN")
    mapping = [
        word
        for key in ("width", "kernel", "spacing")
        if (value := getattr(options, key))
        for word in (f"--{key}", str(value))
    ]
    code = 0
    for folder in options.runs:
        if options.controls:
            mpm, dem = (open_run(files[0]) for files in comparison.run_files(folder))
            controls.make(folder, mpm, dem, options.quiet)

        def say(fraction: float, text: str, name: Path = folder) -> None:
            if not options.quiet:
                print(f"{name}: {100 * fraction:.0f} % {text}", flush=True)

        metrics = report.compare(folder, mapping, say, WIDTHS if options.width_study else ())
        if options.table:
            runs = [open_run(path) for files in comparison.run_files(folder) for path in files]
            verdict_table.write(
                metrics, runs, options.table, " ".join(["./grainpair", *sys.argv[1:]])
            )
        for line in conclusion.lines(metrics):
            print(f"{folder}: {line}" if line.startswith("verdict:") else line)
        for line in conclusion.not_met(metrics, names):
            print(f"{folder}: {line}", file=sys.stderr)
        print(folder / "report.html")
        code = code or conclusion.exit_code(metrics, names)
    return code
