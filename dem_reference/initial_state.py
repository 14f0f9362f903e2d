"""A settled packing as fields on cells of about 2.5 grain diameters.

What a continuum needs to start from the same state.

Cells cut the spheres exactly, and a contact's force times branch is shared among cells along the
branch, the part inside the base left out; so mass is conserved to round-off, the stress carries the
weight above, and walls blur nothing.
"""

import numpy as np

from .contacts import Snapshot
from .void_ratio import clipped_volume

CELL = 2.5  # side of a cell, in diameters: below 2, layers of grains show in the void ratio
POINTS_ON_BRANCH = 8  # points among whose cells a contact's force times branch is shared
COMPONENTS = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "yz": (1, 2), "zx": (2, 0)}


def edges(extent: float, diameter: float) -> np.ndarray:
    """Cell faces from 0 to `extent` [m]."""
    return np.linspace(0, extent, max(1, round(extent / (CELL * diameter))) + 1)


def box_stress(
    shot: Snapshot, lower: np.ndarray, upper: np.ndarray, thickness: float
) -> np.ndarray:
    """Contact stress 1/V sum f (x) b of a box of x and y, or x, y and z, (3, 3) [Pa].

    Compression positive; a contact counts where its point lies.
    """
    point, axes = shot.atoms["x"][shot.i] - shot.branch / 2, len(lower)
    inside = np.all((point[:, :axes] > lower) & (point[:, :axes] < upper), axis=1)
    volume = np.prod(upper - lower) * (thickness if axes == 2 else 1.0)
    return np.einsum("ci,cj->ij", shot.force[inside], shot.branch[inside]) / volume


def fields(shot: Snapshot, length: float, height: float, thickness: float) -> dict[str, np.ndarray]:
    """Mass [kg], void ratio and stress [Pa] of the column's cells.

    Returns x and y (cell faces, nx+1 and ny+1), mass and void_ratio (nx, ny), and stress_xx ...
    stress_zx (nx, ny). Grains outside the column's outline, such as the halves that stand above its
    top, count for the nearest cell.
    """
    g = shot.grains
    x_faces, y_faces = edges(length, g.diameter), edges(height, g.diameter)
    nx, ny = x_faces.size - 1, y_faces.size - 1
    cell_volume = np.outer(np.diff(x_faces), np.diff(y_faces)) * thickness
    grain = shot.atoms["x"][shot.mobile][:, :2]
    radius = shot.of_mobile(shot.radius)
    solid = np.empty((nx, ny))
    open_x, open_y = x_faces.copy(), y_faces.copy()
    open_x[[0, -1]] = (
        min(0, grain[:, 0].min()) - g.diameter,
        max(length, grain[:, 0].max()) + g.diameter,
    )
    open_y[[0, -1]] = (
        min(0, grain[:, 1].min()) - g.diameter,
        max(height, grain[:, 1].max()) + g.diameter,
    )
    for a in range(nx):
        column = (grain[:, 0] > open_x[a] - radius) & (grain[:, 0] < open_x[a + 1] + radius)
        near, of_near = grain[column], radius[column] if isinstance(radius, np.ndarray) else radius
        for b in range(ny):
            solid[a, b] = clipped_volume(
                near,
                of_near,
                np.array([open_x[a], open_y[b]]),
                np.array([open_x[a + 1], open_y[b + 1]]),
            ).sum()
    out = {
        "x": x_faces,
        "y": y_faces,
        "mass": g.density * solid,
        "void_ratio": cell_volume / np.maximum(solid, 1e-300) - 1,
    }

    wall = shot.wall
    start = np.concatenate([shot.atoms["x"][shot.i], shot.atoms["x"][wall.grain]])
    branch = np.concatenate([shot.branch, wall.branch])
    force = np.concatenate([shot.force, wall.force])
    moment = np.einsum("ci,cj->cij", force, branch)
    along = (np.arange(POINTS_ON_BRANCH) + 0.5) / POINTS_ON_BRANCH
    stress = np.zeros((nx * ny, 3, 3))
    for share in along:
        point = start - share * branch
        above = point[:, 1] > 0
        a = np.clip(np.searchsorted(x_faces, point[above, 0]) - 1, 0, nx - 1)
        b = np.clip(np.searchsorted(y_faces, point[above, 1]) - 1, 0, ny - 1)
        np.add.at(stress, a * ny + b, moment[above] / POINTS_ON_BRANCH)
    stress = stress.reshape(nx, ny, 3, 3) / cell_volume[..., None, None]
    for name, (i, j) in COMPONENTS.items():
        out[f"stress_{name}"] = (stress[..., i, j] + stress[..., j, i]) / 2
    return out
