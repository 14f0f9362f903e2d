"""Metrics: one file each, a pure function of a run (or of a pair of runs) and an example with a
known answer.

A metric of one run is computed for each engine; a metric of a pair says how far apart the two are.
"""

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache


@dataclass(frozen=True)
class Metric:
    name: str
    unit: str
    source: str  # where the definition comes from
    definition: str  # the function's docstring
    of_pair: bool
    function: Callable
    margin: str  # key of the case that holds the margin of equivalence; "" without a verdict
    decides: bool = True  # whether its verdict enters the overall one

    def __call__(self, *runs):
        return self.function(*runs)

    def example(self):
        """(arguments, expected value, tolerance) from the metric's own file."""
        return importlib.import_module(self.function.__module__).example()


REGISTRY: dict[str, Metric] = {}


def metric(
    *, unit: str, source: str, of_pair: bool = False, margin: str = "", decides: bool = True
):
    """Registers a function of a Run, or with of_pair of (mpm, dem), under its own name."""

    def register(function):
        REGISTRY[function.__name__] = Metric(
            function.__name__,
            unit,
            source,
            " ".join(function.__doc__.split()),
            of_pair,
            function,
            margin,
            decides,
        )
        return function

    return register


@cache
def all_metrics() -> dict[str, Metric]:
    for module in pkgutil.iter_modules(__path__):
        importlib.import_module(f"{__name__}.{module.name}")
    return REGISTRY
