"""Contacts of the grains, as their frames hold them."""

from collections.abc import Callable, Iterator

import h5py
import numpy as np

from compare.mapping.runs import Run, StoredClouds

FLOOR = -3  # a contact's second, where that is a smooth base
MOVING = 0.02  # of sqrt(g H), along the base


def frames(
    run: Run, record: str
) -> Iterator[tuple[h5py.Group, Callable[[np.ndarray], np.ndarray]]]:
    """Of each frame that holds contacts and `record` of its grains: the contacts, and what gives
    that record of grains by their ids.
    """
    clouds = run.clouds
    if not isinstance(clouds, StoredClouds):
        return
    with h5py.File(clouds.path) as f:
        for step in clouds.steps:
            frame = f[f"data/{step}"]
            cloud = frame["particles/cloud"]
            if "contacts" not in frame or record not in cloud:
                continue
            order = np.argsort(cloud["id"][:])
            ids, values = cloud["id"][:][order], cloud[record][:][order]
            yield frame["contacts"], lambda of: values[np.searchsorted(ids, of)]


def largest_overlap(run: Run) -> float:
    """Largest overlap of two grains over the frames [d]; zero where frames hold no contacts."""
    most = 0.0
    for contacts, radius in frames(run, "radius"):
        first, second = contacts["first"][:], contacts["second"][:]
        grains = second > 0  # walls have negative numbers
        branch = np.stack([contacts["branch"][k][:] for k in "xyz"], axis=-1)[grains]
        touching = sum(radius(i[grains]) for i in (first, second))
        overlap = touching - np.linalg.norm(branch, axis=1)
        most = max(most, float(overlap.max(initial=0.0)) / run.diameter)
    return most


def base_friction(run: Run) -> float:
    """Friction that a smooth base exerts where grains move along it: sums of tangential over normal
    forces of the contacts whose grain is faster than MOVING, all frames together. NaN where the
    frames hold no such contact.
    """
    least = MOVING * np.sqrt(run.case["geometry.gravity"] * run.height)
    along = across = 0.0
    for contacts, velocity in frames(run, "velocity/x"):
        floor = contacts["second"][:] == FLOOR
        speed = velocity(contacts["first"][:][floor])
        x, y = (contacts[f"force/{k}"][:][floor] for k in "xy")
        moves = np.abs(speed) > least
        along -= float(np.sum((np.sign(speed) * x)[moves]))
        across += float(np.sum(y[moves]))
    return along / across if across > 0.0 else float("nan")
