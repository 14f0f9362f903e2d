"""Contacts of the grains, as their frames hold them."""

import h5py
import numpy as np

from compare.mapping.runs import Run, StoredClouds


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
