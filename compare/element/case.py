"""The case file of an element test, as cases/element_schema.toml has it."""

from pathlib import Path

from cases import case
from cases.errors import CaseError
from dem_reference.grains import Grains

# What grains may have in which tests: several sizes only where no data of equal grains are written.
REAL = {
    "size_spread": ("triaxial", "isotropic"),
    "rolling_friction": ("triaxial", "isotropic", "shear", "cooling", "reversal"),
}


class Case:
    """An element test's case: every key of its own tables, checked, with defaults.

    `case["shear.rates"]` is a value by dotted key, `case.grains` the grains, `case.test` the name
    of the test. Raises CaseError with the validator's line.
    """

    def __init__(self, path: Path):
        self.read = case.load(path, kind="element")
        self.path = self.read.path
        self.test = self["element.test"]
        given = self.read["grains"]
        for key, tests in REAL.items():
            if given[key] and self.test not in tests:
                raise CaseError(
                    f"{self.path}: grains.{key} = {given[key]:g} contradicts element.test = "
                    f'"{self.test}" (only {" and ".join(tests)} know it)'
                )

    def __getitem__(self, key: str):
        return self.read[key]

    @property
    def folder(self) -> Path:
        return self.path.parent

    @property
    def grains(self) -> Grains:
        return Grains(**self.read["grains"])
