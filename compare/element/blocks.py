"""Observations of an element test: what the grains measured, and the law's answer to it.

Every measured quantity is compared through its logarithm (the void ratio in triaxial compression
and the shear over pressure in reversal themselves). Its weight is 1/(s^2 + f^2): s the standard
error over seeds, f a floor of MODEL_ERROR, because the law is a model and one well-measured point
must not outvote the others.
"""

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from compare.element.model import Law
from compare.element.records import Rows

MODEL_ERROR = 0.05  # relative; on void ratio MODEL_ERROR x 0.1
Choose = Callable[[list[Rows]], list[Rows]]  # which runs of a point count: one list per seed


def every(seeds: list[Rows]) -> list[Rows]:
    """The `Choose` that takes all seeds of a point."""
    return seeds


@dataclass(frozen=True)
class Block:
    """Observations of one kind, (n,), and the law's answer to them."""

    kind: str  # e.g. "shear pressure"
    labels: list[str]
    measured: np.ndarray
    error: np.ndarray  # standard error over seeds
    floor: float
    predict: Callable[[Law], np.ndarray]
    curve: int = 1  # observations per curve, too correlated to count as more than one

    @property
    def sigma(self) -> np.ndarray:
        return np.hypot(self.error, self.floor) * np.sqrt(self.curve)


def by_point(rows: Rows, keys: tuple[str, ...], choose: Choose = every) -> dict[tuple, list[Rows]]:
    """Rows grouped by the values of `keys`: {point: [rows of a seed]}, seeds as `choose` picks."""
    groups: dict[tuple, dict[float, Rows]] = defaultdict(lambda: defaultdict(list))
    for row in rows:
        groups[tuple(row[key] for key in keys)][row["seed"]].append(row)
    return {point: choose(list(seeds.values())) for point, seeds in sorted(groups.items())}


def mean_and_error(
    values: ArrayLike, least: np.ndarray | float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Mean over seeds (first axis) and its standard error, not below `least`.

    One seed alone has the error `least`.
    """
    values = np.asarray(values, dtype=float)
    error = (
        values.std(axis=0, ddof=1) / np.sqrt(len(values))
        if len(values) > 1
        else np.zeros(values.shape[1:])
    )
    return values.mean(axis=0), np.maximum(error, least)
