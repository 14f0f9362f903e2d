"""Whether grains can be what they are said to be: how dense they lie, how deep they overlap."""

import numpy as np

from compare.importing.frame import Box

DENSEST = 0.75  # solid fraction: of equal spheres the densest packing has 0.7405
DEEPEST = 0.1  # overlap [d]
CELL = 4.0  # side of the cells that solid is counted in [d]
LOOKED_AT = 100_000  # grains whose overlaps are looked at, drawn at random where there are more
NEIGHBOURS = 13  # of each, itself counted: as many equal spheres touch one, and more do not


def densest(place: np.ndarray, radius: np.ndarray, wall: np.ndarray) -> float:
    """Largest solid fraction of cells of 4 d that grains of `radius` (N,) [m] at `place` (N, 3) [m]
    fill; each is spread evenly over the cube of its diameter. Along each axis a whole number of
    cells covers the grains. Cells that hold wall grains are left out.
    """
    d = float(2.0 * np.sum(radius**4) / np.sum(radius**3))
    low = (place - radius[:, None]).min(axis=0)
    extent = (place + radius[:, None]).max(axis=0) - low
    shape = np.maximum(1, extent / (CELL * d)).astype(int)
    side = extent / shape
    if np.prod(shape.astype(float)) > 1e8:
        return 0.0
    volume = 4.0 / 3.0 * np.pi * radius**3
    filled = np.zeros(np.prod(shape))
    first = ((place - radius[:, None] - low) / side).astype(int).clip(0, shape - 1)
    last = ((place + radius[:, None] - low) / side).astype(int).clip(0, shape - 1)
    face = low + last * side
    above = ((place + radius[:, None] - face) / (2.0 * radius[:, None])).clip(0.0, 1.0)
    above = np.where(first == last, 1.0, above)
    for corner in np.ndindex(2, 2, 2):
        upper = np.array(corner, bool)
        share = np.prod(np.where(upper, above, 1.0 - above), axis=1)
        cell = np.ravel_multi_index(tuple(np.where(upper, last, first).T), shape)
        filled += np.bincount(cell, share * volume, len(filled))
    if wall.any():
        there = ((place[wall] - low) / side).astype(int).clip(0, shape - 1)
        cells = np.ravel_multi_index(tuple(there.T), shape)
        filled[cells] = 0.0
    return float(filled.max() / np.prod(side))


def deepest(place: np.ndarray, radius: np.ndarray, wall: np.ndarray, box: Box | None) -> float:
    """Largest overlap of two grains, not both of the wall [d of the smaller]; across the periodic
    faces of a box without tilt too.
    """
    from scipy.spatial import cKDTree  # of packages-studies.txt

    size = np.zeros(3)
    if box is not None and (box.tilt is None or not np.any(box.tilt)):
        size = np.where(box.periodic, box.upper - box.lower, 0.0)
        place = place - box.lower
        inside = np.mod(place, np.where(size > 0.0, size, 1.0))
        place = np.where(size > 0.0, np.where(inside < size, inside, 0.0), place)
    tree = cKDTree(place, boxsize=size)
    rows = np.arange(len(place))
    if len(rows) > LOOKED_AT:
        rows = np.sort(np.random.default_rng(1).choice(rows, LOOKED_AT, replace=False))
    count = min(NEIGHBOURS, len(place))
    far, other = tree.query(place[rows], k=[*range(1, count + 1)])
    overlap = radius[rows, None] + radius[other] - far
    overlap /= 2.0 * np.minimum(radius[rows, None], radius[other])
    overlap[(other == rows[:, None]) | (wall[rows, None] & wall[other])] = 0.0
    return float(overlap.max(initial=0.0))
