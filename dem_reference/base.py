"""The rough base of a chute: glued grains at random places, as of a slice of a packing."""

import numpy as np

# Centres of the base lie at random, no two nearer than this [d], as many as fit: 1.7 per d^2 of the
# plane, where a slice so thick of grains packed at random (solid fraction 0.6) has 1.4. Heights of
# its surface scatter by 0.37 d.
CLOSEST = 0.9
DEEPEST = 1.2  # from the highest centre of the base to the lowest [d]
DENSITY = 1.7  # of centres [1/d2]
TRIES = 20000  # a base is full when so many places in a row were taken


def rough_base(length: float, width: float, diameter: float, seed: int) -> np.ndarray:
    """Centres (n, 3) [m] of the glued grains, tops at y = 0 or below, periodic in x and z: random
    sequential addition.
    """
    random = np.random.default_rng(seed)
    size = np.array([length, DEEPEST * diameter, width])
    closest = CLOSEST * diameter
    placed = np.empty((0, 3))
    failed = 0
    while failed < TRIES:
        candidates = random.uniform(size=(256, 3)) * size
        for one in candidates:
            apart = placed - one
            for axis in (0, 2):
                apart[:, axis] -= size[axis] * np.rint(apart[:, axis] / size[axis])
            if (np.einsum("ij,ij->i", apart, apart) < closest**2).any():
                failed += 1
                continue
            placed, failed = np.vstack([placed, one]), 0
    placed[:, 1] -= (DEEPEST + 0.5) * diameter
    return placed[np.argsort(placed[:, 0], kind="stable")]


def rough_count(length: float, width: float, diameter: float) -> float:
    """About how many that are."""
    return DENSITY * length * width / diameter**2
