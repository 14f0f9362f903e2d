"""Does the numerical error bar cover the error? A run, its siblings, and a run so fine that it
stands for the exact solution; the bar must reach from the first to the last.

    python3 -m compare.study.error_bar CASE TASK -o RESULT.json
"""

import sys
from dataclasses import replace
from pathlib import Path

import pandas as pd

from cases.case import load
from cases.scratch import temporary
from cases.stages import Stage, run_stages
from compare.mapping.runs import map_fields, open_fields, open_run
from compare.metrics import all_metrics
from compare.study import job
from compare.study.recipe import Recipe
from compare.verdict import siblings
from compare.verdict.comparison import pair

# Those that are no figure of the flow's solution: what weighs, what numerics take, what it costs.
LEFT_OUT = {"mass", "mapped_mass", "released_energy", "unaccounted_energy", "cpu_seconds"}
LEFT_OUT |= {f"cpu_seconds_{part}" for part in ("engine", "audit", "output", "setup")}


def make(scene: Path, task: dict) -> dict:
    """Figures of the continuum by metric: of the run (`main`), the fine run and the siblings, and
    the bar.
    """
    recipe = Recipe.of(task["recipe"])
    sets = siblings.overrides(load(scene, recipe.sets))
    fine_cells = [f"mpm.cell_size={float(task['fine'])!r}"]
    asked: dict[str, list[str]] = sets | {"main": [], "fine": fine_cells}
    with temporary() as folder:
        files = {name: folder / f"{name}.h5" for name in asked}
        for name, more in asked.items():
            words = replace(recipe, sets=(*recipe.sets, *more)).words(scene, files[name])
            run_stages([Stage(name, words)], quiet=True)
        map_fields(list(files.values()), folder / "fields.h5")
        runs = {name: open_run(path) for name, path in files.items()}
        for run in runs.values():
            run.mapped = open_fields(folder / "fields.h5", run.name)
        main, fine = runs["main"], runs["fine"]
        pair([fine, runs["coarse"], runs["slow"]], [main])
        bars = siblings.uncertainty(main, main, siblings.Siblings(runs["coarse"], runs["slow"]))
        return {
            "commit": main.attributes["commit"],
            "metrics": {
                name: {of: metric(run) for of, run in runs.items()} | {"bar": bars[name]}
                for name, metric in all_metrics().items()
                if not metric.of_pair and name not in LEFT_OUT
            },
        }


def table(names: list[str], found: list[dict]) -> pd.DataFrame:
    """A row for each scene and metric: run, fine run, error, bar, and whether it covers."""
    rows = [
        {"scene": scene, "metric": name}
        | values
        | {"error": values["main"] - values["fine"]}
        | {"covered": abs(values["main"] - values["fine"]) <= values["bar"]}
        for scene, one in zip(names, found)
        for name, values in one["metrics"].items()
    ]
    return pd.DataFrame(rows)


if __name__ == "__main__":
    sys.exit(job.run("compare.study.error_bar", __doc__, make))
