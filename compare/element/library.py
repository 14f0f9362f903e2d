"""A law of a shared library on the element tests' paths: a card that names it, not constants.

Such a card is a file of its own, looked for by its path, with a [material] table as a case has it:
law = "external", library, interface, constants and what else the law needs.
"""

import os
import tomllib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from cases.errors import CaseError
from compare.element.point import PointModel
from compare.study.recipe import assignment

START = 1e3  # pressure at which a shear test starts: the law's own critical one is not known [Pa]
FILES = ("library", "parameters_file")  # paths, from the card's folder
THERMAL = ("cooling",)  # tests of the granular temperature alone


@dataclass(frozen=True)
class LibraryCard:
    """Keys of [material] as words of --set; paths from the root, where they are paths."""

    name: str
    settings: tuple[str, ...]

    @classmethod
    def read(cls, path: Path) -> "LibraryCard":
        """CaseError for a file that is none, or names no library."""
        try:
            table = tomllib.loads(path.read_text(encoding="utf-8")).get("material", {})
        except (OSError, ValueError, RecursionError) as error:
            raise CaseError(f"{path}: no material card ({error})") from error
        if not isinstance(table, dict) or table.get("law") != "external":
            raise CaseError(
                f"{path}: no card of a shared library (material.law is not external) cards of the "
                "solver's laws are named, and stand in cases/materials"
            )
        for key in FILES:
            if key in table and not isinstance(table[key], str):
                raise CaseError(f"{path}: material.{key} is {table[key]!r} (the path of a file)")
            if key in table and os.path.exists(path.parent / table[key]):
                table[key] = str((path.parent / table[key]).resolve())
        settings = (assignment(f"material.{key}", value) for key, value in table.items())
        return cls(path.stem, tuple(settings))


class LibraryModel(PointModel):
    """A law of a library for given grains. Its granular temperature is not a number."""

    card: LibraryCard  # type: ignore[assignment]

    @property
    def nu_c(self) -> float:
        return float("nan")

    @cached_property
    def settings(self) -> list[str]:
        grains = (f"{name}={value}" for name, value in self.grains.keys().items())
        return [*self.card.settings, *grains]

    def _start(self, nu: float) -> float:
        return START

    def shear(self, nu, rate) -> dict:
        return without_temperature(super().shear(nu, rate))

    def reversal(self, nu, rate, strain, span: float) -> dict:
        return without_temperature(super().reversal(nu, rate, strain, span))


def without_temperature(answers: dict) -> dict:
    temperature = np.full_like(answers["granular_temperature"], np.nan)
    return answers | {"granular_temperature": temperature}


def model_of(path: Path, grains, test: str, **driven) -> LibraryModel:
    """CaseError for a test that asks for nothing but granular temperature."""
    if test in THERMAL:
        raise CaseError(
            f"{path}: a law of a shared library has no granular temperature (a {test} test asks "
            "for nothing else)"
        )
    return LibraryModel(LibraryCard.read(path), grains, **driven)  # type: ignore[arg-type]
