"""Charts: one file each, a function of what a page is about that draws into a figure and returns
the sentence under it.

Those of this folder are about a Comparison, those of `collapse/` about one run of the continuum.
Each is drawn twice, for wide and for narrow pages: `panels` lays axes out in a row or in a column.
"""

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass

import matplotlib.pyplot as plt
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from compare.mapping.runs import Run, about_axis

WIDE, NARROW = 10.0, 3.9  # inches


@dataclass(frozen=True)
class Chart:
    name: str
    title: str
    order: int
    draw: Callable


REGISTRY: dict[str, dict[str, Chart]] = {}  # by folder, as a package, and name


def chart(title: str, order: int):
    """Registers `draw(subject, narrow) -> (figure, sentence)`, or None when the runs hold nothing
    to draw. A third value says what is to be seen where the figure's own numbers (seen.py) do not.
    """

    def register(function):
        folder = function.__module__.rpartition(".")[0]
        REGISTRY.setdefault(folder, {})[function.__name__] = Chart(
            function.__name__, title, order, function
        )
        return function

    return register


def all_charts(folder: str = __name__) -> list[Chart]:
    """The charts of a folder, in the order in which a page shows them."""
    for module in pkgutil.iter_modules(importlib.import_module(folder).__path__):
        importlib.import_module(f"{folder}.{module.name}")
    return sorted(REGISTRY[folder].values(), key=lambda c: c.order)


def along(run: Run) -> str:
    """Label of the axis of places along the flow."""
    return "$r/R_0$" if about_axis(run.case) else "$x/L_0$"


def panels(count: int, narrow: bool, height: float = 3.0, **options):
    """A figure with `count` axes of `height` inches: in a row, or in a column on a narrow page."""
    if narrow:
        figure, axes = plt.subplots(
            count,
            1,
            figsize=(NARROW, 0.92 * height * count),
            squeeze=False,
            layout="constrained",
            **options,
        )
    else:
        figure, axes = plt.subplots(
            1, count, figsize=(WIDE, height), squeeze=False, layout="constrained", **options
        )
    return figure, axes.ravel()


def ticks(axis, low: float, high: float):
    """Marks of a logarithmic axis as plain numbers: 1, 2 and 5 of each decade, and in less than a
    decade and a half 3 besides.
    """
    subs = (1.0, 2.0, 3.0, 5.0) if high < 30.0 * low else (1.0, 2.0, 5.0)
    axis.set_major_locator(LogLocator(subs=subs))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
