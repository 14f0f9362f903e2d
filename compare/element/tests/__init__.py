"""Element tests: one file each, which registers itself under the name that cases give it.

A file holds all there is to a test: its points, its run of the grains, and, where the law has a
counterpart of it, the blocks in which the two are compared and their figure.
"""

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from cases.errors import CaseError
from compare.element.blocks import Block, Choose
from compare.element.card import Card
from compare.element.case import Case
from compare.element.model import Law
from compare.element.records import Rows
from dem_reference.grains import Grains


@dataclass(frozen=True)
class ElementTest:
    """A test of the grains: what a campaign runs."""

    name: str  # `element.test` of its cases
    order: int  # among the other tests
    keys: tuple[str, ...]  # of a point, the seed aside: what names it
    points: Callable[[Case], list[tuple[dict, int]]]  # every point with its seed, first ones first
    run: Callable[[Grains, dict, Path], Rows]  # a point's rows; EngineError when it fails


@dataclass(frozen=True)
class ComparedTest(ElementTest):
    """A test in which the law is held against the grains, and on which it may be calibrated."""

    blocks: Callable[[Rows, Choose], list[Block]]
    draw: Callable[[Rows, dict[str, Law], Path], list[Path]]  # returns the files written
    fitted: Callable[[Rows], Rows] = list  # the rows that a calibration may use
    within: Callable[[Card], bool] = lambda card: True  # whether the card's law can follow at all
    driven: Callable[[Case], dict] = lambda case: {}  # what PointModel is told beside its card
    remarks: Callable[[Case, Rows], list[str]] = lambda case, rows: []  # beside the verdicts


REGISTRY: dict[str, ElementTest] = {}


def register(test: ElementTest) -> ElementTest:
    REGISTRY[test.name] = test
    return test


def all_tests() -> list[ElementTest]:
    for module in pkgutil.iter_modules(__path__):
        importlib.import_module(f"{__name__}.{module.name}")
    return sorted(REGISTRY.values(), key=lambda test: test.order)


def compared_tests() -> list[ComparedTest]:
    return [test for test in all_tests() if isinstance(test, ComparedTest)]


def test_of(case: Case) -> ElementTest:
    """The test that a case is of; CaseError when there is none of that name."""
    known = {test.name: test for test in all_tests()}
    if case.test not in known:
        raise CaseError(
            f"{case.path}: 'element.test' = '{case.test}' (no such file in compare/element/tests) "
            f"use one of {', '.join(known)}"
        )
    return known[case.test]
