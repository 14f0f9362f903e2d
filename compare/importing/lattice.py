"""Images of a periodic box, triclinic ones too, in the axes that the box is told in."""

import numpy as np

from compare.importing.frame import Box


def edges(box: Box) -> np.ndarray:
    """Edges of the box (3, 3) [m], one a row: a along x, b in the plane of x and y, c; those of
    axes that do not repeat are zero.
    """
    out = np.diag((box.upper - box.lower).astype(float))
    if box.tilt is not None:
        out[1, 0], out[2, 0], out[2, 1] = box.tilt
    return out * np.asarray(box.periodic, bool)[:, None]


def shifted(vectors: np.ndarray, box: Box | None, counts) -> np.ndarray:
    """Vectors (N, 3), of which whole edges are taken off: `counts(component / edge)` of each."""
    if box is None:
        return vectors
    out = vectors
    for axis, edge in reversed(list(enumerate(edges(box)))):
        if edge[axis] > 0.0:
            number = counts(out[:, axis] / edge[axis])
            if np.any(number):
                out = out - number[:, None] * edge
    return out


def nearest(branches: np.ndarray, box: Box | None) -> np.ndarray:
    """The nearest images of branches (N, 3)."""
    return shifted(branches, box, np.rint)


def wrapped(places: np.ndarray, box: Box | None) -> np.ndarray:
    """The images inside the box of places (N, 3)."""
    if box is None or not np.any(box.periodic):
        return places
    if box.tilt is None:
        around = np.asarray(box.periodic, bool)
        low, high = places.min(axis=0), places.max(axis=0)
        if np.all((low >= box.lower) & (high < box.upper) | ~around):
            return places
    return shifted(places - box.lower, box, np.floor) + box.lower


def unfolded(places: np.ndarray, images: np.ndarray, box: Box | None) -> np.ndarray:
    """Places (N, 3) without the jumps through periodic faces, as image flags (N, 3) tell them."""
    return places if box is None else places + images @ edges(box)
