"""Judge laws where the grains flow: each law's answer under the grains' own conditions, beside
theirs.

No collapse is computed with a law: the mapped fields of two packings or more give the conditions
(p, γ̇) and (p, γ̇, T) of every cell, of a chute of every height, the law its friction, granular
temperature, dissipation and void ratio there. Written to --out: judge.html, judge.csv, overall.csv
and figures.
"""

import sys
from pathlib import Path

from cases import case, command_line, cores, results, workflow
from cases.errors import CaseError
from cases.lookup import find_case
from cases.programs import name_of, program
from cases.provenance import typed
from cases.scenes import is_chute
from cases.stages import Stage, run_stages
from compare.mapping.runs import open_run
from compare.study import sweep
from dem_reference import ensemble

PACKAGES = ["studies"]
TARGETS = ["programs"]


def arguments(parser):
    parser.add_argument(
        "case",
        metavar="CASE|RUNDIR",
        help="case, whose grains are run where they are not there yet, or folder of a run",
    )
    parser.add_argument("--laws", nargs="+", metavar="LAW", help="laws (every one there is)")
    parser.add_argument(
        "--cards",
        nargs="+",
        metavar="CARD",
        help="cards (all of cases/materials that roll like the scene's grains)",
    )
    parser.add_argument(
        "--also",
        action="append",
        default=[],
        metavar="LAW:CARD,KEY=VALUE,…",
        help="one more law, with other constants, such as "
        "solid_fluid:seed_table1,material.correlation_factor=3.6; may be repeated",
    )
    parser.add_argument(
        "--of",
        choices=["grains", "continuum"],
        default="grains",
        help="whose flow: the grains', or what a run of the continuum visits (%(default)s)",
    )
    command_line.add_overrides(parser)
    parser.add_argument(
        "--seeds",
        type=command_line.several,
        default=2,
        metavar="N",
        help="packings of a case, two at least (%(default)s)",
    )
    parser.add_argument(
        "--widths",
        type=float,
        nargs="+",
        metavar="W",
        help="of the kernel, in grain diameters (0.75 1 1.5; of the continuum 0.4, 0.5 and 0.75 of "
        "a cell)",
    )
    parser.add_argument(
        "--outcome",
        nargs="*",
        metavar="CASE",
        help="also run every law in this case and in others, and hold the deviations of its "
        "collapses against its bias",
    )
    parser.add_argument("--profile", type=Path, metavar="DIR", help=sweep.HELP["profile"])
    parser.add_argument(
        "--jobs", type=command_line.threads, default=cores.jobs(), help=sweep.HELP["jobs"]
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder of the results (runs/judge/<case>)"
    )
    parser.add_argument("--quiet", action="store_true", help="show no progress")


def run(options) -> int:
    import pandas as pd
    from compare.judge import laws, page, trial  # matplotlib takes its time to load
    from compare.judge.outcome import of_scene, regression

    folder = Path(options.case)
    of_run = folder.is_dir() and not (folder / "case.toml").exists()
    if of_run:
        files = runs_of(folder, options)
        scene = open_run(files[0]).case
    else:
        scene = case.load(find_case(options.case), options.overrides)
        files = []
    others = [case.load(find_case(one), options.overrides) for one in options.outcome or []]
    for other in (scene, *others):
        refuse(other, options)
    if options.outcome is not None and (of_run or options.of != "grains"):
        raise CaseError(f"{options.case}: --outcome is of cases and their grains")
    check_widths(options)
    candidates = laws.candidates(scene, options.laws, options.cards, options.also)
    out = options.out or Path("runs") / "judge" / (folder.name if of_run else name_of(scene.path))
    with results.prepared(out) as work:
        files = files or make(scene, options, work)
        said = tell(options.quiet)
        judged = trial.judge(scene, files, candidates, widths(scene, options), said)
        outcome = None
        if options.outcome is not None:
            trials = [judged]
            for other in others:
                runs = make(other, options, work)
                trials.append(trial.judge(other, runs, candidates, widths(other, options), said))
            outcome = pd.concat([of_scene(one, options) for one in trials], ignore_index=True)
        command = typed("./grainpair", sys.argv[1:])
        found = trial.controls(judged)
        table = page.write(judged, found, outcome, work, command)
    print(table.to_string(index=False, float_format=lambda x: f"{x:+.3f}"))
    for one in found:
        print(f"control {'told apart' if one.rejected else 'NOT TOLD APART'}: {one.words}")
    print(*(f"refused: {line}" for line in judged.refused), sep="\n")
    if outcome is not None:
        print(regression(outcome).to_string(index=False, float_format=lambda x: f"{x:.3f}"))
    print(out / "judge.html")
    return 0


def refuse(scene: case.Case, options):
    if options.seeds < 2 and options.of == "grains":
        raise CaseError("--seeds 1: one packing (two at least tell the spread) ask for two or more")
    if options.outcome is not None and is_chute(scene["geometry"]):
        raise CaseError(
            f"{scene.path}: --outcome tells what collapses are off by, and this is a chute leave "
            "it out, or take ./grainpair ladder"
        )


def check_widths(options):
    if options.widths and min(options.widths) <= 0.0:
        raise CaseError(f"--widths {min(options.widths):g}: a width is positive")


def widths(scene: case.Case, options) -> list[float]:
    """Of the kernel [d]. Grains need some of them for an average; points lie closer, and what a
    wide kernel averages away of a gradient is lost.
    """
    if options.widths:
        return options.widths
    if options.of == "grains":
        return [0.75, 1.0, 1.5]
    return [share * scene["mpm.cell_size"] / scene["grains.diameter"] for share in (0.4, 0.5, 0.75)]


def runs_of(folder: Path, options) -> list[Path]:
    """The result files of a run's folder. CaseError where they do not do."""
    if options.overrides:
        raise CaseError(f"{folder}: --set has no effect on a run that is there give a case instead")
    engine = {"grains": "dem", "continuum": "mpm"}[options.of]
    files = sorted(folder.glob(f"{engine}*.h5"), key=lambda path: (len(path.stem), path.stem))
    if not files:
        raise CaseError(f"{folder}: no {engine}.h5 (neither a case nor a run's folder)")
    if engine == "dem" and len(files) < 2:
        raise CaseError(
            f"{folder}: one packing (two at least tell the spread) judge the case, which runs what "
            "is missing, or run it with --seeds 2"
        )
    return files


def make(scene: case.Case, options, work: Path) -> list[Path]:
    """The runs of a case: an ensemble of the grains, or one of the continuum in `work`."""
    if options.of == "grains":
        where = workflow.Where(options.jobs, None)
        seeds = range(1, options.seeds + 1)
        return ensemble.make(scene, options.overrides, seeds, where, quiet=options.quiet)
    sets = [word for assignment in options.overrides for word in ("--set", assignment)]
    path = work / "mpm.h5"
    words = [program("mpm_run"), scene.path, *sets, "--progress", "-o", path]
    run_stages([Stage("continuum (MPM)", words)], quiet=options.quiet)
    return [path]


def tell(quiet: bool):
    def say(fraction: float, text: str):
        if not quiet:
            print(f"{100 * fraction:3.0f} % {text}", file=sys.stderr, flush=True)

    return say
