"""Keys of what studies keep: of the case with a recipe's assignments in it, the task, and the
sources that decide them.
"""

from pathlib import Path

from cases import case, content
from cases.errors import CaseError
from cases.programs import ROOT
from compare.study.recipe import Recipe
from dem_reference import content as grains

CONTINUUM = ("geometry", "grains", "initial", "walls", "material", "mpm", "time")


def inputs(engine: str, scene: case.Case) -> dict:
    """What the engine ("mpm" or "dem") reads of a case."""
    if engine == "dem":
        return grains.inputs(scene)
    return {table: scene[table] for table in CONTINUUM}


def told(path: Path, sets: tuple[str, ...], engine: str) -> dict:
    """The inputs of a case file with assignments; where they are refused, the validator's line in
    their place.
    """
    try:
        return inputs(engine, case.load(path, sets))
    except CaseError as error:
        return {"refused": str(error), "sets": sets}


def sources(engine: str, program: str, root: Path = ROOT) -> list[str]:
    """Digests of what makes a result: the engine, the module `program` with all it imports, and
    grain_map, which some of them call.

    Studies of both engines share modules; what such a module imports of the other engine's folder
    decides nothing here.
    """
    compiled = [file for file in (root / "compare" / "mapping").glob("*.*pp*") if file.is_file()]
    mapper = content.of_files(sorted(compiled), root)
    if engine == "dem":
        return [grains.engine(), grains.sources(program, "dem_reference.run", root=root), mapper]
    modules = content.imported(program, root=root)
    ours = sorted(file for file in modules if not file.is_relative_to(root / "dem_reference"))
    return [content.of_continuum(root), content.of_files(ours, root), mapper]


def key(program: str, recipe: Recipe, scene: case.Case, task=None, root: Path = ROOT) -> str:
    """Name that the result of `program` is kept under: of a recipe, and of what else the task asks
    for.
    """
    asked = [told(scene.path, recipe.sets, recipe.engine), recipe.timeout, recipe.seed, task]
    name = program.rsplit(".", 1)[-1].replace("_", "-")
    made = sources(recipe.engine, program, root)
    return f"{name}-{recipe.engine}-{content.digest([program, asked, made])}"
