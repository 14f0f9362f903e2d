"""One row of a stability map: where along one key runs begin to fail, found by bisection.

    python3 -m compare.study.boundary CASE TASK -o ROW.json
"""

import math
import sys
from pathlib import Path

from cases.errors import Warned
from compare.study import impact, job
from compare.study.failure import DRIFT, warnings_of
from compare.study.point import run
from compare.study.recipe import Recipe, assignment

RATIO = 1.1  # the boundary lies between two runs whose values differ by no more than this factor


def bisect(
    classify, low: float, high: float, ratio: float = RATIO
) -> tuple[list[dict], float, float]:
    """The runs made, the largest value found good and the smallest found bad; NaN and inf where
    there is none.

    classify(value) -> {"status": …}. One boundary is assumed between the ends; if the low end fails
    it is not looked for.
    """
    runs = [{"value": value} | classify(value) for value in (low, high)]
    if runs[0]["status"] != "ok":
        return runs, math.nan, low
    if runs[1]["status"] == "ok":
        return runs, high, math.inf
    good, bad = low, high
    while bad / good > ratio:
        middle = math.sqrt(good * bad)
        runs.append({"value": middle} | classify(middle))
        if runs[-1]["status"] == "ok":
            good = middle
        else:
            bad = middle
    return runs, good, bad


def runs_of(scene: Path, task: dict):
    """The classifier of a task: a run of the continuum, or a collision of two grains."""
    recipe = Recipe.of(task["recipe"])

    def of_continuum(value: float) -> dict:
        told = Recipe(
            recipe.engine,
            (*recipe.sets, assignment(task["along"], float(value))),
            timeout=recipe.timeout,
        )
        point = run(scene, told)
        if point["status"] == "ok" and Warned.DRIFT in warnings_of(point["warnings"]):
            point |= {"status": DRIFT, "message": point["warnings"]}
        return (
            {
                name: point[name]
                for name in ("status", "message", "cpu_seconds", "warnings")
                if name in point
            }
            | {"command": told.command(scene)}
            | ({"dt": point["tau"][-1] / point["steps"]} if point["status"] == "ok" else {})
        )

    def of_grains(value: float) -> dict:
        return impact.collide(scene, recipe.sets, value, task["speed"], task["tolerance"])

    return of_continuum if recipe.engine == "mpm" else of_grains


def make(scene: Path, task: dict) -> dict:
    runs, good, bad = bisect(runs_of(scene, task), *task["between"])
    return {"task": task, "runs": runs, "good": good, "bad": bad}


if __name__ == "__main__":
    sys.exit(job.run("compare.study.boundary", __doc__, make))
