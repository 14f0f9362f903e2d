"""Where the grains of a periodic box start: random, without overlap."""

import numpy as np
from numpy.typing import ArrayLike

from cases.errors import EngineError
from dem_reference.grains import Grains

# Solid fraction of the random sequential addition, safely below its saturation at 0.38.
START = 0.25


def box_side(grains: Grains, count: int, solid_fraction: float) -> float:
    """Side of the cube in which `count` grains have `solid_fraction` [m]."""
    return (count * grains.mean_volume / solid_fraction) ** (1 / 3)


def random_positions(count: int, sides: ArrayLike, seed: int) -> tuple[np.ndarray, float]:
    """Random sequential addition in a periodic box of `sides` (one length or three) [m].

    Returns the centres, (count, 3) [m], and the diameter [m] that makes the solid fraction START:
    the grains are then grown to their own size by the engine. EngineError when it gets stuck.
    """
    sides = np.broadcast_to(sides, 3)
    random = np.random.default_rng(seed)
    diameter = (6 * START * sides.prod() / (np.pi * count)) ** (1 / 3)
    centres = np.empty((count, 3))
    placed = 0
    for _ in range(2000 * count):
        trial = random.random(3) * sides
        apart = centres[:placed] - trial
        apart -= sides * np.round(apart / sides)
        if np.all(np.einsum("ij,ij->i", apart, apart) > diameter**2):
            centres[placed] = trial
            placed += 1
            if placed == count:
                return centres, diameter
    raise EngineError(
        f"packing: placed {placed} of {count} grains (random addition got stuck) another seed "
        "may do"
    )
