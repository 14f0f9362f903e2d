"""Charts: one file each, a function of a Comparison that draws into a figure and returns the sentence under it.

Each is drawn twice, for wide and for narrow pages: `panels` lays axes out in a row or in a column.
"""

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402  (the backend is chosen before pyplot loads)

MPM, DEM, INK, PAPER = "#1f5fa8", "#c8561b", "#26292e", "#ffffff"
LABEL = {"mpm": "MPM", "dem": "DEM"}
COLOUR = {"mpm": MPM, "dem": DEM}

STYLE = {
    "font.family": "DejaVu Sans", "font.size": 9.5, "axes.titlesize": 10, "axes.labelsize": 9.5, "legend.fontsize": 9,
    "axes.edgecolor": "#8a8f98", "axes.labelcolor": INK, "text.color": INK, "xtick.color": INK, "ytick.color": INK,
    "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.color": "#e4e6ea",
    "grid.linewidth": 0.7, "axes.axisbelow": True, "legend.frameon": False, "lines.linewidth": 1.6,
    "figure.facecolor": PAPER, "savefig.facecolor": PAPER, "svg.fonttype": "path", "svg.hashsalt": "grainpair",
}
WIDE, NARROW = 10.0, 3.9  # inches


@dataclass(frozen=True)
class Chart:
    name: str
    title: str
    order: int
    draw: Callable


REGISTRY: dict[str, Chart] = {}


def chart(title: str, order: int):
    """Registers `draw(comparison, narrow) -> (figure, sentence)`, or None when the runs hold nothing to draw."""

    def register(function):
        REGISTRY[function.__name__] = Chart(function.__name__, title, order, function)
        return function

    return register


def all_charts() -> list[Chart]:
    for module in pkgutil.iter_modules(__path__):
        importlib.import_module(f"{__name__}.{module.name}")
    return sorted(REGISTRY.values(), key=lambda c: c.order)


def panels(count: int, narrow: bool, height: float = 3.0, **options):
    """A figure with `count` axes of `height` inches: in a row, or in a column on a narrow page."""
    if narrow:
        figure, axes = plt.subplots(count, 1, figsize=(NARROW, 0.92 * height * count), squeeze=False,
                                    layout="constrained", **options)
    else:
        figure, axes = plt.subplots(1, count, figsize=(WIDE, height), squeeze=False, layout="constrained", **options)
    return figure, axes.ravel()
