"""Run a case with both engines, compare them, write the report.

The results stand in one folder (--out, by default runs/<case>): mpm.h5, dem.h5, fields.h5,
metrics.json, report.html, figures/. They take the place of an earlier run's, and of its controls/
and vtk/, once all of them are complete; other files in the folder stay.
"""

import json
import os
import shutil
import sys
from pathlib import Path

from cases import case, results
from cases.stages import Stage, run_stages
from cases.errors import CaseError
from cases.programs import ROOT, name_of, program
from compare.cost import estimate, refuse_more_than_there_is, table, tell_if_long
from dem_reference.content import ensemble_folder

# What an earlier run may have left in the folder, and what was made of it there.
OURS = ["mpm.h5", "dem.h5", "dem_[0-9]*.h5", "fields.h5", "metrics.json", "report.html", "figures"]
OURS += ["controls", "vtk", "collapse"]
VERDICT = {
    "run_out": "run-out",
    "final_height": "final height",
    "kinetic_energy_peak_time": "time of kinetic-energy peak",
    "dissipated_energy": "energy dissipated",
    "cpu_seconds": "CPU time",
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
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        dest="overrides",
        help="overrides a key of the case; may be repeated",
    )
    parser.add_argument(
        "--seed", type=int, default=1, help="of the packing and of jittered points (%(default)s)"
    )
    parser.add_argument(
        "--seeds",
        type=int,
        default=1,
        metavar="N",
        help="an ensemble of N packings, through Snakemake; the verdicts then weigh its scatter "
        "(%(default)s)",
    )
    parser.add_argument("--threads", type=int, default=1, help="of the continuum (%(default)s)")
    parser.add_argument("--quiet", action="store_true", help="show no progress")
    parser.add_argument(
        "--dry-run", action="store_true", help="only show what the run would take of the machine"
    )


def find_case(name: str) -> Path:
    """`name` as a path if there is one, else the folder of that name in cases/."""
    path, named = Path(name), ROOT / "cases" / name
    if path.exists() or not named.is_dir():
        return path
    return Path(os.path.relpath(named)) if named.is_relative_to(Path.cwd()) else named


def grains(scene: case.Case, options, common: list, scratch: Path) -> tuple[Stage, list[Path]]:
    """The stage that runs the grains, and the result files it makes: one, or one per seed of an
    ensemble.

    An ensemble's files are kept by what decides them, so that a stopped or enlarged one goes on
    where it was.
    """
    if options.seeds == 1:
        result = scratch / "dem.h5"
        words = ["dem_reference.run", *common, "--seed", options.seed, "--progress", "-o", result]
        return Stage("grains (DEM)", [sys.executable, "-m", *words]), [result]
    words = ["dem_reference.ensemble", *common, "--first", options.seed, "--seeds", options.seeds]
    folder = ensemble_folder(scene)
    words += ["--jobs", cores(), "--table", folder / "ensemble.csv"]
    seeds = range(options.seed, options.seed + options.seeds)
    stage = Stage(f"grains (DEM), {options.seeds} seeds", [sys.executable, "-m", *words])
    return stage, [folder / f"{seed}.h5" for seed in seeds]


def cores() -> int:
    return len(os.sched_getaffinity(0))


def run(options) -> int:
    if options.seeds < 1:
        raise CaseError(f"--seeds {options.seeds}: at least one packing is needed")
    scene = case.load(find_case(options.case), options.overrides)
    if scene["geometry.dimension"] == "axisymmetric":
        raise CaseError(
            f"{scene.path}: geometry.dimension: axisymmetric columns are not compared (fields over "
            "the radius have no common grid with those over x) run either engine itself: mpm_run, "
            "python3 -m dem_reference.run"
        )
    takes = estimate(scene, options.seeds)
    if options.dry_run:
        print(table(takes))
        return 0
    refuse_more_than_there_is(scene, takes)
    out = options.out or Path("runs") / name_of(scene.path)
    common = [
        scene.path,
        *(word for assignment in options.overrides for word in ("--set", assignment)),
    ]
    with results.owned(out, takes.disk) as folder, folder.prepare(OURS) as scratch:
        tell_if_long(scene, takes)
        grain_stage, grain_results = grains(scene, options, common, scratch)
        continuum = Stage(
            "continuum (MPM)",
            [
                program("mpm_run"),
                *common,
                "--seed",
                options.seed,
                "--progress",
                "--threads",
                options.threads,
                "-o",
                scratch / "mpm.h5",
            ],
        )
        packed = scene["initial.state"] == "packing"  # the continuum starts from the first packing
        if packed:
            continuum.command.extend(["--packing", grain_results[0]])
        run_stages(
            [grain_stage, continuum], together=cores() > 1 and not packed, quiet=options.quiet
        )
        for number, result in enumerate(grain_results, start=1):
            if result.parent != scratch:
                shutil.copy(result, scratch / ("dem.h5" if number == 1 else f"dem_{number}.h5"))
        with folder.rescued(scratch, "not-compared"):
            run_stages(
                [
                    Stage(
                        "comparison",
                        [sys.executable, "-m", "compare.report", scratch, "--progress"],
                    )
                ],
                quiet=options.quiet,
            )
    print(verdict(json.loads((out / "metrics.json").read_text())))
    print(out / "report.html")
    return 0


def verdict(metrics: dict) -> str:
    """Five lines that say how far the continuum is from the grains."""
    lines = [f"{'':<42}{'MPM':>12}{'DEM':>12}{'MPM/DEM - 1':>14}"]
    for name, words in VERDICT.items():
        entry = metrics[name]
        mpm, dem = (
            "-" if entry[engine] is None else f"{entry[engine]:.4g}" for engine in ("mpm", "dem")
        )
        relative = entry["relative_difference"]
        difference = "-" if relative is None else f"{100 * relative:+.1f} %"
        line = f"{words + ' [' + entry['unit'] + ']':<42}{mpm:>12}{dem:>12}{difference:>14}"
        lines.append(f"{line}   {entry.get('verdict', '')}".rstrip())
    return "\n".join(lines)
