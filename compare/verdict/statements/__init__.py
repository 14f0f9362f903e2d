"""What [Ceccato2019, section 4] says of its column, each sentence as a measurement with a bound:
one file each.

A statement is a function of a run of the continuum. Beside it in its file stand `holding()` and
`failing()`, runs made of formulas of which it must say so. Bounds are the paper's own where it
gives one; where it says "mainly" the bound is half, and each docstring says what stands for words
like "negligible".
"""

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from compare.mapping.runs import Run


@dataclass(frozen=True)
class Finding:
    """figure [the statement's unit]; `until` [sqrt(H/g)] is the instant up to which the run decides
    it; `words` say what else was measured on the way.
    """

    figure: float
    holds: bool
    until: float
    words: str = ""


@dataclass(frozen=True)
class Statement:
    name: str
    text: str
    source: str
    unit: str
    bound: str
    definition: str  # the function's docstring
    order: int
    function: Callable[[Run], Finding]

    def __call__(self, run: Run) -> Finding:
        return self.function(run)

    def examples(self) -> tuple[Run, Run]:
        """A run of which the statement holds and one of which it does not."""
        module = importlib.import_module(self.function.__module__)
        return module.holding(), module.failing()


REGISTRY: dict[str, Statement] = {}


def statement(*, text: str, source: str, unit: str, bound: str, order: int):
    """Registers a function of a Run that returns a Finding, under its own name."""

    def register(function):
        REGISTRY[function.__name__] = Statement(
            function.__name__,
            text,
            source,
            unit,
            bound,
            " ".join(function.__doc__.split()),
            order,
            function,
        )
        return function

    return register


def all_statements() -> list[Statement]:
    for module in pkgutil.iter_modules(__path__):
        importlib.import_module(f"{__name__}.{module.name}")
    return sorted(REGISTRY.values(), key=lambda s: s.order)


def loss(run: Run, until: float) -> float:
    """What the numerics have eaten by the instant `until` [sqrt(H/g)], over the energy released in
    the whole run: the figure that a finding must not be mistaken for.
    """
    return float(np.interp(until, run.energy_tau(), run.joules("unaccounted"))) / run.released()


def judge(run: Run) -> dict[str, dict]:
    """Every statement of a run, as statements.json holds it."""
    found = {}
    for one in all_statements():
        finding = one(run)
        figure = float(finding.figure) if np.isfinite(finding.figure) else None  # JSON has no NaN
        found[one.name] = {
            "text": one.text,
            "source": one.source,
            "figure": figure,
            "unit": one.unit,
            "bound": one.bound,
            "verdict": "holds" if finding.holds else "does not hold",
            "words": finding.words,
            "until": finding.until,
            "numerical_loss": loss(run, finding.until),
            "definition": one.definition,
        }
    return found
