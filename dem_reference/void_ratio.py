"""Void ratio of a box cut out of a packing, from the exact volume of each sphere inside it."""

from typing import Any

import numpy as np

# Gauss-Legendre points for spheres cut by an edge (two planes at once): relative error below 1e-5
# of a sphere.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)


def cap_fraction(distance: np.ndarray, radius: np.ndarray | float) -> np.ndarray:
    """Share of a sphere on the side of a plane that its centre is `distance` inside of.

    Negative: outside; same shape. Radii are those of each sphere (n,), or of all [m], here and
    below.

    With t = distance/radius in [-1, 1]: (2 + 3 t - t^3) / 4.
    """
    t = np.clip(distance / radius, -1, 1)
    return (2 + 3 * t - t**3) / 4


def _circle_area_below(height: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Area of a disc of `radius` below the line at `height` above its centre."""
    h = np.clip(height, -radius, radius)
    safe = np.where(radius > 0, radius, 1.0)
    return radius**2 * (np.arcsin(h / safe) + np.pi / 2) + h * np.sqrt(radius**2 - h**2)


def clipped_volume(
    centre: np.ndarray, radius: np.ndarray | float, lower: np.ndarray, upper: np.ndarray
) -> np.ndarray:
    """Volume of each sphere inside the rectangle lower..upper of x and y (z is not cut).

    centre (n, 2), result (n,).
    """
    sphere = 4 / 3 * np.pi * radius**3
    inside = np.minimum(centre - lower, upper - centre)
    share_x, share_y = (
        cap_fraction(centre[:, k] - lower[k], radius)
        + cap_fraction(upper[k] - centre[:, k], radius)
        - 1
        for k in (0, 1)
    )
    volume = sphere * share_x * share_y  # exact unless both x and y cut the sphere
    wide: Any = radius[:, None] if isinstance(radius, np.ndarray) else radius
    volume[np.any(inside <= -wide, axis=1)] = 0.0
    edge = np.flatnonzero(np.all(np.abs(inside) < wide, axis=1))
    if edge.size:  # integrate the disc's area over x
        x, y = centre[edge, 0], centre[edge, 1]
        at: Any = radius[edge] if isinstance(radius, np.ndarray) else radius
        a, b = np.maximum(lower[0] - x, -at), np.minimum(upper[0] - x, at)
        wide = wide[edge] if isinstance(wide, np.ndarray) else wide
        s = (a + b)[:, None] / 2 + (b - a)[:, None] / 2 * _NODES
        disc = np.sqrt(np.maximum(wide**2 - s**2, 0))
        area = _circle_area_below((upper[1] - y)[:, None], disc) - _circle_area_below(
            (lower[1] - y)[:, None], disc
        )
        volume[edge] = (area * _WEIGHTS).sum(axis=1) * (b - a) / 2
    return volume


def void_ratio(
    centre: np.ndarray, radius: np.ndarray | float, lower, upper, thickness: float
) -> float:
    """e = voids / solid of the box lower..upper (x, y) through the whole thickness.

    Overlaps count twice as solid. A box with limits of z too cuts each sphere's volume by the share
    of the sphere between them: exact unless z cuts it together with x or y.
    """
    lower, upper = np.asarray(lower, float), np.asarray(upper, float)
    solid = clipped_volume(centre[:, :2], radius, lower[:2], upper[:2])
    volume = np.prod(upper - lower)
    if len(lower) == 2:
        volume *= thickness
    else:
        solid = solid * (
            cap_fraction(centre[:, 2] - lower[2], radius)
            + cap_fraction(upper[2] - centre[:, 2], radius)
            - 1
        )
    return float(volume / solid.sum() - 1) if solid.sum() > 0 else float("inf")


def bulk_box(length: float, height: float, diameter: float) -> tuple[np.ndarray, np.ndarray]:
    """The box in which a column's bulk void ratio is measured.

    2.5 d away from base, walls and free surface.
    """
    margin = 2.5 * diameter
    return np.array([margin, margin]), np.array([length - margin, height - margin])


def quarter_bulk_box(
    radius: float, height: float, diameter: float
) -> tuple[np.ndarray, np.ndarray]:
    """The same for a quarter of a cylinder about the y axis: a box of x, y and z inside it."""
    margin = 2.5 * diameter
    side = (radius - margin) / np.sqrt(2)
    return np.full(3, margin), np.array([side, height - margin, side])
