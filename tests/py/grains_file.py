"""A grains.h5 in the layout of CONTRIBUTING.md, as any program can write it."""

import h5py
import numpy as np


def write_grains(path, frames, **attributes):
    """`frames`: dicts of time, x, v (N, 3), radius (N,), density, and perhaps lower, upper (of the
    box), id, kind, spin, contacts (first, second (C,), branch, position, force (C, 3)).
    """
    root = {"openPMD": "1.1.0", "basePath": "/data/%T/", "engine": "dem", "schema_version": 1}
    with h5py.File(path, "w") as f:
        f.attrs.update(root | attributes)
        for step, frame in enumerate(frames):
            group = f.create_group(f"data/{step}")
            none = np.full(3, np.nan)
            lower, upper = frame.get("lower", none), frame.get("upper", none)
            group.attrs.update({"time": frame["time"], "box_lower": lower, "box_upper": upper})
            volume = 4.0 / 3.0 * np.pi * frame["radius"] ** 3
            records = {
                "id": frame.get("id", np.arange(1, len(volume) + 1)),
                "kind": frame.get("kind", np.ones(len(volume), np.int8)),
                "radius": frame["radius"],
                "mass": frame["density"] * volume,
                "solid_volume": volume,
                "position": frame["x"],
                "velocity": frame["v"],
            }
            if "spin" in frame:
                records["angular_velocity"] = frame["spin"]
            for folder, all_of in (
                ("particles/cloud", records),
                ("contacts", frame.get("contacts", {})),
            ):
                for name, values in all_of.items():
                    if np.ndim(values) == 1:
                        group[f"{folder}/{name}"] = values
                    else:
                        for k, axis in enumerate("xyz"):
                            group[f"{folder}/{name}/{axis}"] = values[:, k]
    return path
