"""Where the scene is: its origin, and the plane walls that what lies behind them is folded at.

A case has its left wall at x = 0, the floor's surface at y = 0 and its front at z = 0. A file may
have them elsewhere: then they are taken from what tells them, and said, or asked for.
"""

from dataclasses import dataclass, replace

import numpy as np

from cases.errors import CaseError
from compare.importing.axes import Axes
from compare.importing.frame import Box

TOUCHING = 0.2  # of a diameter: how far a grain may be from a wall it touches
FAR = 1.0001  # diameters off which a column stands elsewhere, round-off included
ROUND_OFF = 1e-9  # of a diameter
NAMES = ("left wall", "floor", "front")


@dataclass(frozen=True)
class Edges:
    """Of the grains that move, in our axes [m]: the lowest and highest points of their surfaces at
    the first frame and over all frames, (3,) each; `glued`: the top of wall grains that lie below
    them, if there are any.
    """

    low: np.ndarray
    high: np.ndarray
    lowest: np.ndarray
    highest: np.ndarray
    glued: float | None


def walls(edges: Edges, box: Box | None, grain: float) -> tuple[np.ndarray, np.ndarray]:
    """Places (3,) of plane walls below and above [m], NaN where there is none: fixed faces of the
    box that grains touch, and the top of the glued floor.
    """
    low, high = np.full(3, np.nan), np.full(3, np.nan)
    if box is not None:
        for k in range(3):
            if box.periodic[k]:
                continue
            if box.fixed[k, 0] and abs(edges.lowest[k] - box.lower[k]) < TOUCHING * grain:
                low[k] = box.lower[k]
            if box.fixed[k, 1] and abs(edges.highest[k] - box.upper[k]) < TOUCHING * grain:
                high[k] = box.upper[k]
    if edges.glued is not None:
        low[1] = edges.glued
    low, high = (np.where(np.abs(one) < ROUND_OFF * grain, 0.0, one) for one in (low, high))
    return low, high


def origin(
    edges: Edges,
    box: Box | None,
    low: np.ndarray,
    grain: float,
    axes: Axes,
    source: str,
    notes: list[str],
) -> np.ndarray:
    """Where a case's origin is, (3,) [m] in our axes as turned so far. Raises CaseError where the
    column stands elsewhere and nothing tells by how much.
    """
    out = np.zeros(3)
    for k, wall in enumerate(low):
        name, off = NAMES[k], np.nan
        if k == 2:
            if box is not None and box.periodic[2]:
                off = box.lower[2]
        elif np.isfinite(wall):
            off = wall
        if np.isfinite(off):
            if abs(off) > 1e-6 * grain and not (k == 1 and abs(off) < FAR * grain):
                out[k] = off
                source = "the glued grains" if k == 1 and edges.glued is not None else "the box"
                notes.append(f"shifted: {name} from {off:.6g} m to 0, where {source} has it")
        elif abs(edges.low[k]) > FAR * grain:
            there = axes.turn.T @ np.where(np.arange(3) == k, edges.low, _known(low, box))
            words = " ".join(f"{one:.6g}" for one in there)
            raise CaseError(
                f"{source}: the grains begin at {edges.low[k]:.6g} m along {axes.words[k]}, the "
                f"case has its {name} at 0 (nothing tells where it is) give --origin {words}"
            )
    return out


def _known(low: np.ndarray, box: Box | None) -> np.ndarray:
    """Places that are told, else zero."""
    out = np.where(np.isfinite(low), low, 0.0)
    if box is not None and box.periodic[2]:
        out[2] = box.lower[2]
    return out


def moved(edges: Edges, by: np.ndarray) -> Edges:
    """The same after a shift of the origin."""
    glued = None if edges.glued is None else edges.glued - by[1]
    low, high, lowest, highest = (
        one - by for one in (edges.low, edges.high, edges.lowest, edges.highest)
    )
    return replace(edges, low=low, high=high, lowest=lowest, highest=highest, glued=glued)
