"""What the grains say of a scene: the mean of an ensemble, and how far its members are from one another."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

from cases import case
from compare.verdict.comparison import pair
from cases.errors import CaseError, EngineError
from compare.metrics import all_metrics
from cases.programs import ROOT
from cases.files import write_atomically
from compare.mapping.runs import open_run
from compare.study.provenance import about
from compare.study.signature import compact, errors, expand, mean


def arguments(parser):
    parser.add_argument(
        "--ensemble", type=Path, metavar="DIR", help="folder of the grains' runs <seed>.h5"
    )
    parser.add_argument(
        "--reference",
        type=Path,
        metavar="FILE",
        help="the grains' mean as an earlier study wrote it (grains.json)",
    )
    parser.add_argument(
        "--seeds",
        type=int,
        metavar="N",
        help="make an ensemble of N seeds, or what is missing of it, in "
        "runs/ensembles/<case>/ensemble. Without these three: that ensemble if it is there, else "
        "cases/<case>/reference/grains.json, else 8 seeds",
    )


def obtain(scene: case.Case, options) -> dict:
    """The reference that the options name: {"about", "members": [signature...], "mean": signature, "scatter": {metric: [errors]}, ...}."""
    name = scene.path.parent.name if scene.path.name == "case.toml" else scene.path.stem
    folder = options.ensemble or ROOT / "runs" / "ensembles" / name / "ensemble"
    committed = scene.path.parent / "reference" / "grains.json"
    if options.reference:
        return read(options.reference)
    if options.ensemble and not any(folder.glob("[0-9]*.h5")):
        raise CaseError(f"{folder}: no run <seed>.h5 in it")
    if not any(folder.glob("[0-9]*.h5")) and not options.seeds and committed.exists():
        return read(committed)
    if not options.ensemble and (options.seeds or not any(folder.glob("[0-9]*.h5"))):
        make(scene, folder, options)
    return of_runs(sorted(folder.glob("[0-9]*.h5"), key=lambda path: int(path.stem)), scene)


def make(scene: case.Case, folder: Path, options):
    """The ensemble of the case, resumed where it stands."""
    words = [
        sys.executable,
        "-m",
        "dem_reference.ensemble",
        scene.path,
        "--seeds",
        options.seeds or 8,
        "--jobs",
        options.jobs,
        "--table",
        folder / "ensemble.csv",
        *(["--profile", options.profile] if options.profile else []),
    ]
    done = subprocess.run(
        [str(word) for word in words], cwd=ROOT, check=False, capture_output=True, text=True
    )
    if done.returncode:
        raise EngineError((done.stderr.strip() or "ensemble: failed").splitlines()[-1])


def read(path: Path) -> dict:
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise CaseError(f"{path}: not a reference of the grains ({error})") from error


def of_runs(files: list[Path], scene: case.Case) -> dict:
    """The reference of an ensemble's files. Each member is held against the mean of the others."""
    if len(files) < 2:
        raise CaseError(
            f"{files[0].parent if files else scene.path}: {len(files)} run of the grains (two at least show a scatter)"
        )
    runs = [open_run(file) for file in files]
    for run in runs:
        for key in (
            "geometry.height",
            "geometry.length",
            "grains.diameter",
        ):
            if run.case[key] != scene[key]:
                raise CaseError(
                    f"{run.case.path}: {key} = {run.case[key]}, but {scene[key]} in {scene.path} (not its ensemble)"
                )
    seeds = [compact(run) for run in runs]
    left_out = [
        errors(seed, mean([other for other in seeds if other is not seed], scene), scene)
        for seed in seeds
    ]
    return {
        "about": about(runs[0].attributes["command"], commit=runs[0].attributes["commit"]),
        "members": seeds,
        "mean": mean(seeds, scene),
        "scatter": {name: [one[name] for one in left_out] for name in left_out[0]},
        "cpu_seconds": [seed["cpu_seconds"] for seed in seeds],
        "cpu_seconds_packing": [seed["cpu_seconds_packing"] for seed in seeds],
        "duration": float(np.mean([seed["tau"][-1] for seed in seeds])),
        "seeds": [seed["seed"] for seed in seeds],
        "spread": spread(seeds, scene),
    }


def spread(seeds: list[dict], scene: case.Case) -> dict[str, dict]:
    """Values of the scalar metrics over the seeds."""
    runs = [expand(seed, scene) for seed in seeds]
    pair([], runs)
    names = ("run_out", "run_out_99", "dissipated_energy", "kinetic_energy_peak")
    values = {name: [float(all_metrics()[name](run)) for run in runs] for name in names}
    return {
        name: {"mean": float(np.mean(v)), "std": float(np.std(v, ddof=1)), "values": v}
        for name, v in values.items()
    }


def write(reference: dict, path: Path):
    write_atomically(path, json.dumps(reference) + "\n")
