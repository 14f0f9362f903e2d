"""Runs recipes as one workflow: what is there is kept, what is missing is run, some at a time or on
a cluster.
"""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cases import case, command_line, cores, results, workflow
from cases.programs import kept, name_of, short
from compare.study import keys
from compare.study.recipe import Recipe

HELP = {
    "jobs": "runs at a time, of one thread each (%(default)s: cores, and memory for them)",
    "profile": "a Snakemake profile, such as dem_reference/slurm: the runs go to a cluster",
}


def arguments(parser):
    """The case and the options that every study has."""
    parser.add_argument(
        "case",
        metavar="CASE",
        help="case file, folder that holds case.toml, or name of a folder in cases/",
    )
    parser.add_argument(
        "--jobs", type=command_line.threads, default=cores.jobs(), help=HELP["jobs"]
    )
    parser.add_argument("--profile", type=Path, metavar="DIR", help=HELP["profile"])
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder of tables and figures (runs/studies/<case>/<study>)",
    )


@contextmanager
def prepared(scene: case.Case, options, study: str, page: str) -> Iterator[Path]:
    """Where the tables and figures of a study are made; they take their place in its folder when
    all are there, and the file `page` among them is named to the user.
    """
    out = options.out or Path("runs") / "studies" / name_of(scene.path) / study
    with results.prepared(out) as work:
        yield work
    print(out / page)


def sweep(
    scene: case.Case, tasks: dict[str, dict], options, program: str = "compare.study.point"
) -> dict[str, dict]:
    """The results of the tasks, by the key each is kept under in runs/studies/points
    (compare/study/keys.py).

    `program` makes one of them: python3 -m PROGRAM CONFIG KEY -o RESULT.json, where CONFIG holds
    "case" and "recipes". Raises EngineError when one cannot be made (a run that fails is a result).
    """
    store = kept("studies", "points")
    if any(not (store / f"{key}.json").exists() for key in tasks):
        path = scene.path.parent if scene.path.name == "case.toml" else scene.path
        config = {"case": str(short(path)), "recipes": tasks, "program": program}
        where = workflow.Where(options.jobs, options.profile)
        workflow.run(Path(__file__).with_name("Snakefile"), store, config, where)
    return {key: json.loads((store / f"{key}.json").read_text()) for key in tasks}


def run_tasks(scene: case.Case, tasks: list[dict], options, program: str) -> list[dict]:
    """The result of each task, in order; a task is a recipe as JSON, or holds one as "recipe"
    beside what else it asks.
    """
    names = []
    for task in tasks:
        recipe = Recipe.of(task.get("recipe", task))
        more = {name: asked for name, asked in task.items() if name != "recipe"}
        # such a result also tells the commands of its runs, in the recipe's words
        asked = more | {"sets": recipe.sets} if "recipe" in task else None
        names.append(keys.key(program, recipe, scene, asked))
    found = sweep(scene, dict(zip(names, tasks)), options, program)
    return [found[name] for name in names]


def run_recipes(scene: case.Case, recipes: list[Recipe], options) -> list[dict]:
    """The point of each recipe, in order; see compare/study/point.py.

    Recipes that tell the engine the same in other words share a point, and each is given it as its
    own.
    """
    names = [keys.key("compare.study.point", recipe, scene) for recipe in recipes]
    tasks = {name: recipe.as_json() for name, recipe in zip(names, recipes)}
    points = sweep(scene, tasks, options)
    return [
        points[name] | {"key": name, "recipe": recipe.as_json()}
        for name, recipe in zip(names, recipes)
    ]
