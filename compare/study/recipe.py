"""Recipes: an engine and what it is told beside the case.

A study's recipes stand in cases/<case>/study.toml.
"""

import itertools
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from cases import case
from cases.errors import CaseError
from cases.programs import PYTHON, module, program
from cases.provenance import typed
from cases.scenes import refuse_chute


@dataclass(frozen=True)
class Recipe:
    engine: str  # mpm | dem
    sets: tuple[str, ...] = ()  # "key=value", as --set takes them
    series: str = ""  # what the recipe varies, in words
    timeout: float = 600.0  # processor seconds
    seed: int = 1

    def __getitem__(self, key: str) -> str | None:
        """The value the recipe gives to a key of the case, if it does."""
        return next(
            (word.split("=", 1)[1] for word in reversed(self.sets) if word.split("=", 1)[0] == key),
            None,
        )

    @property
    def label(self) -> str:
        return (
            ", ".join(
                word.split(".", 1)[1].replace("_", " ").replace("=", " ") for word in self.sets
            )
            or "as the case says"
        )

    def words(self, scene: Path, result: str | Path) -> list[str]:
        """The command line that runs it."""
        mpm = self.engine == "mpm"
        engine = [str(program("mpm_run"))] if mpm else module("dem_reference.run")
        return [*engine, *self.asked(scene, result)]

    def command(self, scene: Path) -> str:
        """The same as a user types it in the project's folder."""
        python = f"{PYTHON} -m dem_reference.run"
        engine = "build/release/mpm_run" if self.engine == "mpm" else python
        return typed(engine, self.asked(scene, f"{self.engine}.h5"))

    def asked(self, scene: Path, result: str | Path) -> list[str]:
        """What either engine is told."""
        sets = [word for assignment in self.sets for word in ("--set", assignment)]
        return [str(scene), *sets, "--seed", str(self.seed), "--quiet", "-o", str(result)]

    def as_json(self) -> dict:
        return asdict(self)

    @classmethod
    def of(cls, values: dict[str, Any]) -> "Recipe":
        told: dict[str, Any] = values | {"sets": tuple(values["sets"])}
        return cls(**told)


def study(scene: case.Case, name: str) -> dict:
    """The table [<name>] of the case's study.toml, checked against cases/study_schema.toml.

    Raises CaseError with the file and line of a mistake, or when there is no such table.
    """
    refuse_chute(scene, f"[{name}] is a study")
    file = scene.path.with_name("study.toml")
    if not file.exists():
        raise CaseError(
            f"{file}: no such file (it holds the recipes of the case's studies) "
            "see cases/column_small/study.toml"
        )
    table = case.load(file, kind="study").values.get(name)
    if table is None:
        raise CaseError(f"{file}: has no table [{name}] (the recipes of this study)")
    return table


def expand(series: dict, timeout: float) -> list[Recipe]:
    """The recipes of one [[…series]].

    Every combination of the values of `vary`, each with the assignments of `set`.
    """
    keys, values = list(series.get("vary", {})), list(series.get("vary", {}).values())
    fixed = [assignment(key, value) for key, value in series.get("set", {}).items()]
    recipes = []
    for chosen in itertools.product(*values):
        varied = [assignment(key, value) for key, value in zip(keys, chosen)]
        recipes.append(
            Recipe(
                series["engine"],
                tuple(fixed + varied),
                series["name"],
                series.get("timeout", timeout),
            )
        )
    return recipes


def assignment(key: str, value) -> str:
    """The word of --set that gives a key a value."""
    if isinstance(value, bool):
        return f"{key}={str(value).lower()}"
    return f"{key}={value:g}" if isinstance(value, float) else f"{key}={value}"


def unique(recipes: list[Recipe]) -> list[Recipe]:
    """Without those that ask for what an earlier one asks for."""
    seen: dict[tuple, Recipe] = {}
    for recipe in recipes:
        seen.setdefault((recipe.engine, frozenset(recipe.sets), recipe.seed), recipe)
    return list(seen.values())
