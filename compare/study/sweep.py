"""Runs recipes as one workflow: what is there is kept, what is missing is run, some at a time or on
a cluster.
"""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from cases import case, command_line, cores, cost, results, workflow
from cases.cost import Cost
from cases.errors import CaseError, EngineError
from cases.jobs import Job
from cases.members import Members
from cases.programs import kept, name_of, short
from compare.study import keys
from compare.study.recipe import Recipe
from compare.verdict import siblings
from dem_reference import cost as grains_cost
from dem_reference.packing import dict_of

POINT = "compare.study.point"  # the program that makes one run of one recipe
HELP = {
    "jobs": "runs at a time, of one thread each (%(default)s: cores, and memory for them)",
    "profile": "a Snakemake profile, such as cases/slurm: the runs go to a cluster",
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
    parser.add_argument("--quiet", action="store_true", help="show no progress")


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
    scene: case.Case, tasks: dict[str, dict], options, program: str = POINT
) -> dict[str, dict]:
    """The results of the tasks, by the key each is kept under in runs/studies/points
    (compare/study/keys.py).

    `program` makes one of them: python3 -m PROGRAM CASE TASK -o RESULT.json. Raises
    EngineError when one cannot be made (a run that fails is a result).
    """
    store = kept("studies", "points")
    files = {key: store / f"{key}.json" for key in tasks}
    if any(not file.exists() for file in files.values()):
        path = scene.path.parent if scene.path.name == "case.toml" else scene.path
        where = workflow.Where(options.jobs, options.profile)
        asked = program.endswith(".point") and (where.profile or not options.quiet)
        costs = estimates(scene, tasks, files) if asked else {}
        jobs = {
            key: Job(
                file,
                (program, str(short(path)), json.dumps(tasks[key]), "-o", str(file)),
                seconds=costs[key].seconds if key in costs else 0.0,
                bytes=costs[key].bytes if key in costs else 0.0,
            )
            for key, file in files.items()
        }
        labels = {key: recipe_of(task).label for key, task in tasks.items()}
        seconds = {key: one.seconds for key, one in costs.items()}
        members = Members("runs of the study", files, labels, seconds, options.quiet)
        workflow.run(jobs, store, where, members)
    return {key: json.loads(file.read_text()) for key, file in files.items()}


def recipe_of(task: dict) -> Recipe:
    """A task is a recipe as JSON, or holds one as "recipe" beside what else it asks."""
    return Recipe.of(task.get("recipe", task))


def estimates(scene: case.Case, tasks: dict[str, dict], files: dict[str, Path]) -> dict[str, Cost]:
    """What each task takes that is one run, where it is not done and the engine does not refuse."""
    missing = {key: recipe_of(task) for key, task in tasks.items() if not files[key].exists()}
    found = {key: estimate(scene, recipe) for key, recipe in missing.items()}
    return {key: one for key, one in found.items() if one}


def estimate(scene: case.Case, recipe: Recipe) -> Cost | None:
    """Of a point, with the processor time of its siblings; None where the engine refuses the
    recipe, which is a result of the study's.
    """
    try:
        asked = case.load(scene.path, recipe.sets)
        if recipe.engine == "dem":
            return grains_cost.estimate(dict_of(asked))
        one = cost.continuum(asked)
        return replace(one, seconds=one.seconds * (1.0 + 2.0 / siblings.COARSER**3))
    except (CaseError, EngineError):
        return None


def run_tasks(scene: case.Case, tasks: list[dict], options, program: str) -> list[dict]:
    """The result of each task, in order (recipe_of)."""
    names = []
    for task in tasks:
        recipe = recipe_of(task)
        more = {name: asked for name, asked in task.items() if name != "recipe"}
        # such a result also tells the commands of its runs, in the recipe's words
        asked = more | {"sets": recipe.sets} if "recipe" in task else None
        names.append(keys.key(program, recipe, scene, asked))
    found = sweep(scene, dict(zip(names, tasks)), options, program)
    return [found[name] for name in names]


def run_recipes(
    scene: case.Case, recipes: list[Recipe], options, program: str = POINT
) -> list[dict]:
    """The point of each recipe, in order, as `program` makes it; see compare/study/point.py.

    Recipes that tell the engine the same in other words share a point, and each is given it as its
    own.
    """
    names = [keys.key(program, recipe, scene) for recipe in recipes]
    tasks = {name: recipe.as_json() for name, recipe in zip(names, recipes)}
    points = sweep(scene, tasks, options, program)
    return [
        points[name] | {"key": name, "recipe": recipe.as_json()}
        for name, recipe in zip(names, recipes)
    ]
