"""Contacts of the grains, as their frames hold them."""

import h5py
import numpy as np

from compare.mapping.runs import Run, StoredClouds

FLOOR = -3  # a contact's second, where that is a smooth base
MOVING = 0.02  # of sqrt(g H), along the base


def largest_overlap(run: Run) -> float:
    """Largest overlap of two grains over the frames [d]; zero where frames hold no contacts."""
    clouds = run.clouds
    if not isinstance(clouds, StoredClouds):
        return 0.0
    most = 0.0
    with h5py.File(clouds.path) as f:
        for step in clouds.steps:
            frame = f[f"data/{step}"]
            if "contacts" not in frame or "radius" not in frame["particles/cloud"]:
                continue
            cloud, contacts = frame["particles/cloud"], frame["contacts"]
            first, second = contacts["first"][:], contacts["second"][:]
            grains = second > 0  # walls have negative numbers
            branch = np.stack([contacts["branch"][k][:] for k in "xyz"], axis=-1)[grains]
            order = np.argsort(cloud["id"][:])
            ids, radius = cloud["id"][:][order], cloud["radius"][:][order]
            touching = sum(radius[np.searchsorted(ids, i[grains])] for i in (first, second))
            overlap = touching - np.linalg.norm(branch, axis=1)
            most = max(most, float(overlap.max(initial=0.0)) / run.diameter)
    return most


def base_friction(run: Run) -> float:
    """Friction that a smooth base exerts where grains move along it: sums of tangential over normal
    forces of the contacts whose grain is faster than MOVING, all frames together. NaN where the
    frames hold no such contact.
    """
    clouds = run.clouds
    least = MOVING * np.sqrt(run.case["geometry.gravity"] * run.height)
    along = across = 0.0
    if not isinstance(clouds, StoredClouds):
        return float("nan")
    with h5py.File(clouds.path) as f:
        for step in clouds.steps:
            frame = f[f"data/{step}"]
            if "contacts" not in frame:
                continue
            cloud, contacts = frame["particles/cloud"], frame["contacts"]
            floor = contacts["second"][:] == FLOOR
            order = np.argsort(cloud["id"][:])
            place = np.searchsorted(cloud["id"][:][order], contacts["first"][:][floor])
            speed = cloud["velocity/x"][:][order][place]
            x, y = (contacts[f"force/{k}"][:][floor] for k in "xy")
            moves = np.abs(speed) > least
            along -= float(np.sum((np.sign(speed) * x)[moves]))
            across += float(np.sum(y[moves]))
    return along / across if across > 0.0 else float("nan")
