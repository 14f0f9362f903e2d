"""Input files, as Python sees them: checked and completed by mpm_case, and read back from its TOML.

There is no other validator.
"""

import json
import os
import sys
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from cases.errors import CaseError, EngineError
from cases.programs import ROOT, call, program


@dataclass(frozen=True)
class Case:
    """Every key of the schema of the file's kind with a value of its declared type, in bounds.

    `case["geometry.height"]` is a value, `case["geometry"]` a table of them; units are those of
    cases/schema.toml, or of the schema of another kind.
    """

    path: Path
    text: str  # the file as its author wrote it
    resolved: str  # the complete case as TOML
    values: dict
    contradictions: tuple[str, ...] = ()  # to its grains, one line each, as the validator warns

    def __getitem__(self, key: str):
        value = self.values
        for word in key.split("."):
            value = value[word]
        return value


def load(path: str | Path, overrides: Iterable[str] = (), kind: str = "scene") -> Case:
    """The case of a file, or of a folder with a case.toml; `overrides` are a scene's "key=value".

    `kind` is scene, element, point or study; "" leaves it to the file's name. Raises CaseError with
    the validator's line; EngineError if the validator is not built.
    """
    path = Path(path)
    if os.path.isdir(path):
        path = path / "case.toml"
    command = [
        str(program("mpm_case")),
        str(path),
        *(["--kind", kind] if kind else []),
        *(word for assignment in overrides for word in ("--set", assignment)),
    ]
    check = call(command)
    if check.returncode == 2:
        raise CaseError(check.stderr.strip())
    if check.returncode:
        raise EngineError(check.stderr.strip() or f"mpm_case: ended with code {check.returncode}")
    return Case(
        path,
        path.read_text(),
        check.stdout,
        tomllib.loads(check.stdout),
        tuple(check.stderr.strip().splitlines()),
    )


def stiffness(path: str | Path, overrides: Iterable[str] = ()) -> dict[str, dict[str, float]]:
    """What is made of the stiffness of a scene's engines, "mpm" and "dem": stiffness_factor of the
    bulk modulus, weight_to_stiffness and softening_error (cases/stiffness.hpp) [-]. Raises
    CaseError as load does.
    """
    words = [word for assignment in overrides for word in ("--set", assignment)]
    told = call([str(program("mpm_case")), str(path), "--stiffness", *words])
    if told.returncode:
        raise (CaseError if told.returncode == 2 else EngineError)(told.stderr.strip())
    return json.loads(told.stdout)


def tell_contradictions(case: Case):
    """What of a scene's constants contradicts its grains, on standard error."""
    for line in case.contradictions:
        print(line, file=sys.stderr)


def parse(resolved: str, path: str | Path = "", text: str = "") -> Case:
    """The scene of a resolved TOML text, such as the attribute `case_resolved` of a result file.

    A file written before the schema gained a key has that key's default. Raises CaseError where it
    is no TOML, or a value is not of its key's type.
    """
    at = f"{path}: case_resolved"
    try:
        values = tomllib.loads(resolved)
    except (tomllib.TOMLDecodeError, TypeError, AttributeError) as error:
        raise CaseError(f"{at}: not a case ({error})") from error
    return Case(Path(path), text, resolved, completed(values, schema(), at))


@cache
def schema() -> dict:
    """cases/schema.toml: a key is a table that has a `type`, everything else a table of keys."""
    keys = tomllib.loads((ROOT / "cases" / "schema.toml").read_text())
    del keys["former"]
    return keys


# Types of TOML that a type of the schema takes.
TYPES: dict[str, tuple[type, ...]] = {
    "float": (float, int),
    "integer": (int,),
    "boolean": (bool,),
    "string": (str,),
    "choice": (str,),
}


def completed(values: dict, keys: dict, at: str = "") -> dict:
    """`values` with the defaults of the keys they lack; raises CaseError, which begins with `at`,
    where one is not of its key's type.
    """
    if not isinstance(values, dict):
        raise CaseError(f"{at}: not a table ({values!r})")
    for name, key in keys.items():
        if "type" not in key:
            values[name] = completed(values.get(name, {}), key, f"{at}: {name}")
        elif name in values:
            taken = TYPES.get(key["type"], (object,))
            if type(values[name]) not in taken and object not in taken:  # a bool is no int
                raise CaseError(f"{at}: {name} = {values[name]!r} (no {key['type']})")
        elif "default" in key:
            values[name] = key["default"]
    return values
