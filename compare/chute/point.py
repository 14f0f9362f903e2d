"""One point of a study of a chute: runs a recipe and keeps its steady flow, or how it failed.

python3 -m compare.chute.point CASE TASK -o POINT.json
"""

import sys
from pathlib import Path

from compare.chute.signature import compact
from compare.study import job, point
from compare.study.recipe import Recipe


def make(scene: Path, task: dict) -> dict:
    recipe = Recipe.of(task)
    return {"recipe": recipe.as_json()} | point.run(scene, recipe, compact)


if __name__ == "__main__":
    sys.exit(job.run("compare.chute.point", __doc__, make))
