"""Run a case with both engines, compare them, write the report.

The results stand in one folder (--out, by default runs/<case>): mpm.h5, dem.h5, fields.h5,
metrics.json, report.html, figures/, siblings/. They take the place of an earlier run's, and of its
controls/ and vtk/, once all of them are complete; other files in the folder stay.

A run that was stopped goes on when the same command is given again: an engine from its last
checkpoint (output.checkpoint_interval).
"""

import json
import shutil
import sys
from pathlib import Path

from cases import case, command_line, content, cores, handed, memory, results
from cases.jobs import Job
from cases.stages import Stage, run_chains, run_stages
from cases.lookup import find_case
from cases.errors import CaseError
from cases.programs import module, name_of, program
from cases.scenes import is_chute
from cases.unfinished import Unfinished
from compare.chute import words as of_chute
from compare.cost import Estimate, estimate, refuse_more_than_there_is, table, tell_if_long
from compare.study import sweep
from compare.verdict import conclusion, siblings
from dem_reference.content import ensemble_folder, ensemble_key
from dem_reference.ranks import refuse_without_mpi

# What an earlier run may have left in the folder, and what was made of it there.
OURS = ["mpm.h5", "dem.h5", "dem_[0-9]*.h5", "fields.h5", "metrics.json", "report.html", "figures"]
OURS += ["profiles.csv", "siblings", "controls", "vtk", "collapse"]
CELLS_OF_RANK = 8  # along the column, at least (mpm/README.md, Ranks)
VERDICT = {
    "run_out_95": "run-out, 95 % of the mass",
    "centre_of_mass_x": "centre of mass, along x",
    "final_height": "final height",
    "kinetic_energy_peak_time": "time of kinetic-energy peak",
    "dissipated_energy": "energy dissipated",
    "moving_without_stress": "moving without stress",
    "cpu_seconds_engine": "CPU time of the engine",
}


def arguments(parser):
    parser.add_argument(
        "case",
        nargs="?",
        default="column_small",
        help="case file, folder that holds case.toml, or name of a folder in cases/ (%(default)s)",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder of the results (runs/<case>)"
    )
    command_line.add_overrides(parser)
    parser.add_argument(
        "--seed",
        type=command_line.seed,
        default=1,
        help="of the packing and of jittered points (%(default)s)",
    )
    parser.add_argument(
        "--seeds",
        type=command_line.several,
        default=1,
        metavar="N",
        help="an ensemble of N packings; the verdicts then weigh its scatter " "(%(default)s)",
    )
    parser.add_argument(
        "--threads",
        type=command_line.threads,
        help="of the continuum (what the grains and its siblings leave of this machine's cores)",
    )
    parser.add_argument(
        "--ranks",
        type=command_line.threads,
        default=1,
        metavar="N",
        help="MPI ranks that share the scene of each engine (%(default)s)",
    )
    parser.add_argument("--profile", type=Path, metavar="DIR", help=sweep.HELP["profile"])
    parser.add_argument("--quiet", action="store_true", help="show no progress")
    again = parser.add_mutually_exclusive_group()
    again.add_argument(
        "--resume",
        action="store_true",
        help="go on with a run of this case that was stopped, or refuse to begin (without it, "
        "go on where there is one)",
    )
    again.add_argument(
        "--anew", action="store_true", help="begin anew where a run of the same case was stopped"
    )
    parser.add_argument(
        "--no-siblings",
        action="store_true",
        help="leave out the two cheap runs that tell the continuum's numerical error",
    )
    parser.add_argument(
        "--dry-run", action="store_true", help="only show what the run would take of the machine"
    )
    conclusion.require_argument(parser)


def grains(
    scene: case.Case, options, common: list, scratch: Path, jobs: int
) -> tuple[Stage, list[Path]]:
    """The stage that runs the grains, and the result files it makes: one, or one per seed of an
    ensemble.

    An ensemble's files are kept by what decides them, so that a stopped or enlarged one goes on
    where it was.
    """
    if options.seeds == 1 and not options.profile:
        result = scratch / "dem.h5"
        words = ["dem_reference.run", *common, *shared(options), "--seed", options.seed]
        words += ["--progress", "-o", result]
        return Stage("grains (DEM)", module(*words), result=result), [result]
    words = ["dem_reference.ensemble", *common, *shared(options)]
    words += ["--first", options.seed, "--seeds", options.seeds]
    folder = ensemble_folder(scene, options.ranks)
    words += ["--jobs", jobs, "--table", folder / "ensemble.csv", "--progress"]
    words += ["--profile", options.profile.resolve()] if options.profile else []
    seeds = range(options.seed, options.seed + options.seeds)
    stage = Stage(f"grains (DEM), {options.seeds} seeds", module(*words))
    return stage, [folder / f"{seed}.h5" for seed in seeds]


def shared(options) -> list:
    """Words that have an engine's scene shared."""
    return ["--ranks", options.ranks] if options.ranks > 1 else []


def run(options) -> int:
    names = conclusion.required(options.require)
    scene = case.load(find_case(options.case), options.overrides)
    case.tell_contradictions(scene)
    if is_chute(scene["geometry"]):
        options.no_siblings = True  # they tell what collapses are off by
        refuse_of_chute(scene, names)
    if options.ranks > 1:
        refuse_to_share(scene, options.ranks, here=not options.profile)
    takes = estimate(scene, options.seeds, not options.no_siblings)
    if options.dry_run:
        print(table(takes))
        return 0
    refuse_more_than_there_is(scene, takes)
    out = options.out or Path("runs") / name_of(scene.path)
    common = [
        scene.path,
        *(word for assignment in options.overrides for word in ("--set", assignment)),
    ]
    goes_on = Unfinished(key(scene, options), options.resume, options.anew)
    with results.owned(out, takes.disk) as folder, folder.prepare(OURS, goes_on=goes_on) as scratch:
        tell_if_long(scene, takes)
        plan = plan_of(scene, options, takes)
        grain_stage, grain_results = grains(scene, options, common, scratch, plan.grains)
        packed = scene["initial.state"] == "packing"  # the continuum starts from the first packing
        common += ["--packing", grain_results[0]] if packed else []
        if options.profile:
            on_cluster(scene, options, common, grain_stage, scratch, takes)
        else:
            engines(scene, options, common, grain_stage, scratch, plan)
        for number, result in enumerate(grain_results, start=1):
            if result.parent != scratch:
                shutil.copy(result, scratch / ("dem.h5" if number == 1 else f"dem_{number}.h5"))
        with folder.rescued(scratch, "not-compared"):
            compared = Stage("comparison", module("compare.report", scratch, "--progress"))
            run_stages([compared], quiet=options.quiet)
    metrics = json.loads((out / "metrics.json").read_text())
    told = of_chute.lines(metrics) if is_chute(scene["geometry"]) else figures(metrics)
    print("\n".join([*told, *conclusion.lines(metrics)]))
    for line in conclusion.not_met(metrics, names):
        print(line, file=sys.stderr)
    print(out / "report.html")
    return conclusion.exit_code(metrics, names)


def figures(metrics: dict) -> list[str]:
    """Of a collapse."""
    return [verdict(metrics), *stiffness(metrics)]


def refuse_of_chute(scene: case.Case, names: list[str]):
    """What is asked of collapses alone."""
    if names:
        raise CaseError(
            f"--require: {names[0]} is a figure of collapses ({scene.path} is a chute) leave it out"
        )


def refuse_to_share(scene: case.Case, ranks: int, here: bool):
    """What an engine would find only when it is its turn: no MPI, where that is to be `here`, or a
    scene that it does not share.
    """
    if here:
        refuse_without_mpi()
    if here and not program("mpm_run_ranks").exists():
        raise CaseError(
            "--ranks: mpm_run_ranks is not there (the build found no MPI) install the package "
            "libopenmpi-dev, and build again"
        )
    cells = scene["geometry.length"] / scene["mpm.cell_size"]
    most = max(1, int(cells / CELLS_OF_RANK))
    if cells < CELLS_OF_RANK * ranks:
        raise CaseError(
            f"{scene.path}: --ranks {ranks}: the column is {cells:.0f} cells long (a rank takes "
            f"{CELLS_OF_RANK} at least) take {most} at most, or smaller mpm.cell_size"
        )


def key(scene: case.Case, options) -> str:
    """Of what decides the results of the engines."""
    asked = [scene.resolved, options.seed, options.seeds, options.no_siblings, options.ranks]
    return content.digest([asked, content.of_continuum(), ensemble_key(scene, options.ranks)])


def plan_of(scene: case.Case, options, takes: Estimate) -> cores.Plan:
    """How the engines share the cores; with fewer seeds at a time where memory is short."""
    left = max(0.0, memory.available() - takes.mpm.bytes * (1 if options.no_siblings else 2))
    return cores.plan(
        cores.usable(),
        takes.mpm.counts["points"],
        max(1, min(options.seeds, int(left / takes.dem.bytes))),
        siblings=not options.no_siblings,
        waits=scene["initial.state"] == "packing",
        threads=options.threads,
        ranks=options.ranks,
    )


def engines(
    scene: case.Case,
    options,
    common: list,
    grain_stage: Stage,
    scratch: Path,
    plan: cores.Plan,
):
    """Runs the grains, the continuum and its siblings into the scratch folder, beside each other as
    planned.
    """
    words = [*common, "--seed", options.seed]
    threads = ["--threads", plan.threads]
    told = [program("mpm_run"), *words, *threads, *shared(options), "--progress"]
    told += ["-o", scratch / "mpm.h5"]
    continuum = [Stage("continuum (MPM)", told, result=scratch / "mpm.h5")]
    alone = [] if plan.siblings_beside else threads
    more = [] if options.no_siblings else siblings.stages(scene, [*words, *alone], scratch)
    apart = [continuum, more] if plan.siblings_beside else [[*continuum, *more]]
    if plan.beside:
        failed = run_chains([[grain_stage], *apart], quiet=options.quiet)
    elif plan.siblings_beside:
        run_stages([grain_stage], quiet=options.quiet)
        failed = run_chains(apart, quiet=options.quiet)
    else:
        failed = run_chains([[grain_stage, *apart[0]]], quiet=options.quiet)
    siblings.note(scratch, failed)


def on_cluster(
    scene: case.Case,
    options,
    common: list,
    grain_stage: Stage,
    scratch: Path,
    takes: Estimate,
):
    """The same on a cluster, where each run is a job."""
    threads, waits = options.threads or 1, scene["initial.state"] == "packing"
    scratch = scratch.resolve()  # nobody there knows where this command was typed
    words = [scene.path.resolve(), *common[1:], "--seed", options.seed, "--threads", threads]
    result = scratch / "mpm.h5"
    told = [program("mpm_run"), *words, *shared(options), "--progress", "-o", result]
    stages = [Stage("continuum (MPM)", told, result=result)]
    stages += [] if options.no_siblings else siblings.stages(scene, words, scratch)
    there = []
    for one in stages:
        assert one.result
        asked = ("mpm_run", *(str(word) for word in one.command[1:]))
        ranks = options.ranks if one.result == result else 1  # siblings are alone
        room = takes.mpm.bytes + (ranks - 1) * cores.RANK_BYTES
        job = Job(one.result, asked, ranks * threads, takes.mpm.seconds, room)
        there.append(handed.stage(one, options.profile, job))
    if waits:
        run_stages([grain_stage], quiet=options.quiet)
        failed = run_chains([[one] for one in there], quiet=options.quiet)
    else:
        failed = run_chains([[grain_stage], *([one] for one in there)], quiet=options.quiet)
    siblings.note(scratch, failed)


def uncertain(entry: dict, key: str) -> str:
    """What a figure is uncertain by, such as " ± 0.02"; "" where nobody knows."""
    return "" if entry.get(key) is None else f" ± {entry[key]:.2g}"


def verdict(metrics: dict) -> str:
    """A line for each headline that says how far the continuum is from the grains."""
    lines = [f"{'':<42}{'MPM':>18}{'DEM':>18}{'MPM/DEM - 1':>14}"]
    for name, words in VERDICT.items():
        entry = metrics[name]
        mpm, dem = (
            "-" if entry[engine] is None else f"{entry[engine]:.4g}" + uncertain(entry, key)
            for engine, key in (("mpm", "numerical_uncertainty"), ("dem", scatter_key(entry)))
        )
        relative = entry["relative_difference"]
        difference = "-" if relative is None else f"{100 * relative:+.1f} %"
        line = f"{words + ' [' + entry['unit'] + ']':<42}{mpm:>18}{dem:>18}{difference:>14}"
        lines.append(f"{line}   {conclusion.verdict_words(entry)}".rstrip())
    return "\n".join(lines)


def stiffness(metrics: dict) -> list[str]:
    """A line of what was softened, and what that may move; none where nothing was."""
    parts = [
        f"{words} to {metrics['weight_to_stiffness'][engine]:.2g} ({100 * error:.2g} %)"
        for engine, words in (("mpm", "continuum"), ("dem", "grains"))
        if (error := metrics["softening_error"][engine])
    ]
    return [f"softened, rho g H/K (and what it may move): {', '.join(parts)}"] if parts else []


def scatter_key(entry: dict) -> str:
    """Where an entry holds the scatter of the packings: of this run's own, or stored."""
    return "dem_std" if "dem_std" in entry else "stored_std"
