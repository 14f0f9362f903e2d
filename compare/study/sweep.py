"""Runs recipes as one Snakemake workflow: what is there is kept, what is missing is run, some at a time or on a cluster."""

import json
import os
import subprocess
from pathlib import Path

from cases import case
from cases.errors import EngineError
from cases.programs import ROOT
from compare.study.recipe import Recipe

HELP = {
    "jobs": "runs at a time (%(default)s)",
    "profile": "a Snakemake profile, such as dem_reference/slurm: the runs go to a cluster",
}


def arguments(parser):
    """Options that every study has."""
    parser.add_argument("--jobs", type=int, default=2, help=HELP["jobs"])
    parser.add_argument("--profile", type=Path, metavar="DIR", help=HELP["profile"])
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder of tables and figures (runs/studies/<case>/<study>)",
    )


def relative(path: Path) -> Path:
    """A path as a user in the project's folder types it."""
    path = path.resolve()
    return path.relative_to(ROOT) if path.is_relative_to(ROOT) else path


def sweep(
    scene: case.Case, tasks: dict[str, dict], options, program: str = "compare.study.point"
) -> dict[str, dict]:
    """The results of the tasks, by the key each is kept under in runs/studies/points.

    `program` makes one of them: python3 -m PROGRAM CONFIG KEY -o RESULT.json, where CONFIG holds "case" and "recipes".
    Raises EngineError when one cannot be made (a run that fails is a result).
    """
    store = ROOT / "runs" / "studies" / "points"
    store.mkdir(parents=True, exist_ok=True)
    if any(not (store / f"{key}.json").exists() for key in tasks):
        config = store / f"config-{os.getpid()}.json"
        path = scene.path.parent if scene.path.name == "case.toml" else scene.path
        config.write_text(
            json.dumps(
                {
                    "case": str(relative(path)),
                    "recipes": tasks,
                    "program": program,
                    "file": str(config),
                }
            )
        )
        words = [
            "snakemake",
            "-s",
            Path(__file__).with_name("Snakefile"),
            "--configfile",
            config,
            "--directory",
            store,
            "--rerun-incomplete",
            "--rerun-triggers",
            "mtime",
            "--keep-going",
            "--nolock",
            "--quiet",
            "all",
        ]
        words += (
            ["--profile", options.profile.resolve()]
            if options.profile
            else ["--cores", options.jobs]
        )
        try:
            done = subprocess.run(
                [str(word) for word in words], cwd=ROOT, check=False, capture_output=True, text=True
            )
        finally:
            config.unlink()
        if done.returncode:
            raise EngineError(
                f"study: not every run could be started (see {store / '.snakemake' / 'log'}) "
                f"run it again to take up the rest: {done.stderr.strip().splitlines()[-1:]}"
            )
    return {key: json.loads((store / f"{key}.json").read_text()) for key in tasks}


def run_recipes(scene: case.Case, recipes: list[Recipe], options) -> list[dict]:
    """The point of each recipe, in order; see compare/study/point.py."""
    keys = [recipe.key(scene) for recipe in recipes]
    points = sweep(scene, {key: recipe.as_json() for key, recipe in zip(keys, recipes)}, options)
    return [points[key] | {"key": key} for key in keys]
