"""The part of the grains' kinetic energy that is not coarse motion."""

import numpy as np

from .contacts import Snapshot

CELL = 3.0  # side of the cells in x and y, in diameters
FEWEST = 8  # grains a cell needs; the fit of an affine field through fewer leaves too little


def fluctuation_energy(shot: Snapshot) -> float:
    """1/2 sum m |v - (a + B (x, y))|^2 about the least-squares affine velocity of each cell [J].

    A fit of three constants per component leaves n - 3 of n degrees of freedom, so each cell's sum
    is scaled by n / (n - 3). Grains of cells with fewer than FEWEST grains are left out: a lone
    grain has no coarse motion to differ from.
    """
    g = shot.grains
    x, v = shot.atoms["x"][shot.mobile], shot.atoms["v"][shot.mobile]
    if shot.radial:
        x, v = cylindrical(x, v)
    index = np.floor(x[:, :2] / (CELL * g.diameter)).astype(np.int64)
    index -= index.min(axis=0)
    cell = index[:, 0] * (index[:, 1].max() + 1) + index[:, 1]
    _, cell, count = np.unique(cell, return_inverse=True, return_counts=True)
    kept = count[cell] >= FEWEST
    if not kept.any():
        return 0.0
    cells = np.unique(cell[kept])
    c = np.searchsorted(cells, cell[kept])
    x, v, n = x[kept, :2] / g.diameter, v[kept], count[cells]
    mean_x, mean_v = _sums(x, c, n.size) / n[:, None], _sums(v, c, n.size) / n[:, None]
    x, v = x - mean_x[c], v - mean_v[c]
    gram = _sums((x[:, :, None] * x[:, None, :]).reshape(-1, 4), c, n.size).reshape(-1, 2, 2)
    moment = _sums((x[:, :, None] * v[:, None, :]).reshape(-1, 6), c, n.size).reshape(-1, 2, 3)
    gradient = np.linalg.pinv(gram, hermitian=True) @ moment
    rest = v - np.einsum("pi,pij->pj", x, gradient[c])
    squares = np.bincount(c, (rest * rest).sum(axis=1), n.size)
    return float(g.mass / 2 * (squares * n / (n - 3)).sum())


def cylindrical(x: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions, (n, 3), as distance from the y axis, y and azimuth.

    Velocities, (n, 3), as v_r, v_y, v_theta.
    """
    r, theta = np.hypot(x[:, 0], x[:, 2]), np.arctan2(x[:, 2], x[:, 0])
    c, s = np.cos(theta), np.sin(theta)
    return (
        np.column_stack([r, x[:, 1], theta]),
        np.column_stack([c * v[:, 0] + s * v[:, 2], v[:, 1], c * v[:, 2] - s * v[:, 0]]),
    )


def _sums(values: np.ndarray, cell: np.ndarray, cells: int) -> np.ndarray:
    return np.column_stack([np.bincount(cell, column, cells) for column in values.T])
