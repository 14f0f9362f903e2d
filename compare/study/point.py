"""One point of a study: runs a recipe and keeps its signature, or how it failed.

python3 -m compare.study.point CASE TASK -o POINT.json

A failure of the engine is a result like any other: the program fails itself only when it cannot run
the recipe at all.
"""

import os
import resource
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from cases.case import load
from cases.errors import Failure, code_of
from cases.programs import call
from cases.scratch import temporary
from compare.mapping.reductions import has_temperature
from compare.mapping.runs import Run, map_fields, open_fields, open_run
from compare.study import job
from compare.study.failure import classify
from compare.study.recipe import Recipe
from compare.study.signature import compact
from compare.verdict import siblings


def measure(scene: Path, recipe: Recipe) -> dict:
    """The recipe's signature, or its failure: class, message and the processor seconds it had
    taken. `siblings` of a run of the continuum are the signatures, or failures, of the two runs
    that tell its numerical error.
    """
    point = run(scene, recipe)
    if recipe.engine == "mpm" and point["status"] == "ok":
        assignments = siblings.overrides(load(scene, recipe.sets))
        point["siblings"] = {
            name: run(scene, replace(recipe, sets=(*recipe.sets, *more)))
            for name, more in assignments.items()
        }
    return point


def run(scene: Path, recipe: Recipe, told: Callable[[Path], dict] | None = None) -> dict:
    """One run of the engine, as a failure or a signature: what `told` makes of the result file, of
    a collapse if it is left out.
    """
    told = told or (lambda result: compact(mapped(result)))

    def limited():
        resource.setrlimit(resource.RLIMIT_CPU, (int(recipe.timeout) + 1, int(recipe.timeout) + 5))

    before = children()
    with temporary() as folder:
        result = folder / "run.h5"
        words = recipe.words(scene, result)
        done = call(words, before=limited, env=os.environ | {"OMP_NUM_THREADS": "1"})
        if done.returncode == 0:
            return {"status": "ok"} | told(result)
    spent = children() - before
    said = done.stderr.strip().splitlines()
    line = said[-1] if said else f"ended with code {done.returncode} and no word"
    code = code_of(line)
    if code is None and done.returncode < 0:  # SIGXCPU, of the program or of a process of its own
        code = Failure.CPU_LIMIT
    if code == Failure.CPU_LIMIT:
        line = f"stopped after {spent:.0f} s of processor time"
    return {"status": classify(code), "message": line, "cpu_seconds": spent}


def mapped(result: Path) -> Run:
    """The run of a result with its fields, mapped beside it: of every frame where it has a
    temperature, else of the last, which tells the height.
    """
    found = open_run(result)
    fields = result.with_name(f"fields_{result.name}")
    some = () if has_temperature(found) else ("--frame", str(len(found.time) - 1))
    map_fields([result], fields, "--threads", "1", *some)
    found.mapped = open_fields(fields, found.name)
    return found


def children() -> float:
    """Processor seconds of the programs run so far."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def make(scene: Path, task: dict) -> dict:
    recipe = Recipe.of(task)
    return {"recipe": recipe.as_json()} | measure(scene, recipe)


if __name__ == "__main__":
    sys.exit(job.run("compare.study.point", __doc__, make))
