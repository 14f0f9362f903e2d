"""Run a case with both engines, compare them, write the report.

The results stand in one folder (--out, by default runs/<case>): mpm.h5, dem.h5, fields.h5, metrics.json,
report.html, figures/.
"""

import json
import os
import shutil
import sys
import tempfile
from pathlib import Path

from compare import case
from compare.engines import Stage, run_stages
from compare.programs import ROOT, program

DERIVED = ["fields.h5", "metrics.json", "report.html", "figures"]
VERDICT = {
    "run_out": "run-out",
    "final_height": "final height",
    "kinetic_energy_peak_time": "time of kinetic-energy peak",
    "dissipated_energy": "energy dissipated",
    "cpu_seconds": "CPU time",
}


def arguments(parser):
    parser.add_argument("case", nargs="?", default="column_small",
                        help="case file, folder that holds case.toml, or name of a folder in cases/ (%(default)s)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder of the results (runs/<case>)")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides",
                        help="overrides a key of the case; may be repeated")
    parser.add_argument("--seed", type=int, default=1, help="of the packing and of jittered points (%(default)s)")
    parser.add_argument("--threads", type=int, default=1, help="of the continuum (%(default)s)")
    parser.add_argument("--quiet", action="store_true", help="show no progress")


def find_case(name: str) -> Path:
    """`name` as a path if there is one, else the folder of that name in cases/."""
    path, named = Path(name), ROOT / "cases" / name
    if path.exists() or not named.is_dir():
        return path
    return Path(os.path.relpath(named)) if named.is_relative_to(Path.cwd()) else named


def name_of(path: Path) -> str:
    path = path.resolve()
    return path.parent.name if path.name == "case.toml" else path.stem


def run(options) -> int:
    scene = case.load(find_case(options.case), options.overrides)
    out = options.out or Path("runs") / name_of(scene.path)
    out.parent.mkdir(parents=True, exist_ok=True)
    common = [scene.path, "--seed", options.seed, "--progress",
              *(word for assignment in options.overrides for word in ("--set", assignment))]
    # Both engines or neither: their results move into the folder when both have ended well.
    with tempfile.TemporaryDirectory(prefix=f".{out.name}-", dir=out.parent) as scratch:
        mpm, dem = Path(scratch) / "mpm.h5", Path(scratch) / "dem.h5"
        run_stages([Stage("grains (DEM)", [sys.executable, "-m", "dem_reference.run", *common, "-o", dem]),
                    Stage("continuum (MPM)", [program("mpm_run"), *common, "--threads", options.threads, "-o", mpm])],
                   together=len(os.sched_getaffinity(0)) > 1, quiet=options.quiet)
        out.mkdir(exist_ok=True)
        for name in DERIVED:
            shutil.rmtree(out / name) if (out / name).is_dir() else (out / name).unlink(missing_ok=True)
        for result in (mpm, dem):
            os.replace(result, out / result.name)
    run_stages([Stage("comparison", [sys.executable, "-m", "compare.report", out, "--progress"])], quiet=options.quiet)
    print(verdict(json.loads((out / "metrics.json").read_text())))
    print(out / "report.html")
    return 0


def verdict(metrics: dict) -> str:
    """Five lines that say how far the continuum is from the grains."""
    lines = [f"{'':<42}{'MPM':>12}{'DEM':>12}{'MPM/DEM - 1':>14}"]
    for name, words in VERDICT.items():
        entry = metrics[name]
        mpm, dem = ("-" if entry[engine] is None else f"{entry[engine]:.4g}" for engine in ("mpm", "dem"))
        relative = entry["relative_difference"]
        difference = "-" if relative is None else f"{100 * relative:+.1f} %"
        line = f"{words + ' [' + entry['unit'] + ']':<42}{mpm:>12}{dem:>12}{difference:>14}   {entry.get('verdict', '')}"
        lines.append(line.rstrip())
    return "\n".join(lines)
