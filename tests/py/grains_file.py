"""A grains.h5 in the layout of CONTRIBUTING.md, as any program can write it, and a lattice to put
into it.
"""

import h5py
import numpy as np

D, DENSITY, G = 1e-3, 2500.0, 9.81  # [m], [kg/m3], [m/s2]


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


def column(n=(6, 10, 4), force=None):
    """A cubic lattice of touching grains on a floor at y = 0, periodic in x and z: each grain
    carries those above it; the floor carries all. With it every contact, those across the faces
    x and z with the force `force` [N].
    """
    nx, ny, nz = n
    index = np.indices(n).reshape(3, -1).T
    x = (index + 0.5) * D
    number = {tuple(i): k + 1 for k, i in enumerate(index)}
    weight = DENSITY * np.pi / 6 * D**3 * G
    rows = []
    for i in index:
        below = tuple(i - [0, 1, 0])
        held = weight * (ny - i[1])
        up, side = np.array([0.0, D, 0.0]), np.array([D, 0.0, 0.0])
        if i[1]:
            rows.append((number[tuple(i)], number[below], up, up / D * held))
        else:
            rows.append((number[tuple(i)], -3, up / 2, up / D * held))
        if force:
            left = tuple([(i[0] - 1) % nx, i[1], i[2]])
            rows.append((number[tuple(i)], number[left], side, side / D * force))
    first, second, branch, push = (np.array(values) for values in zip(*rows))
    start = x[first - 1]
    centre = np.where((second < 0)[:, None], start - branch, start - 0.5 * branch)
    contacts = {"first": first, "second": second, "branch": branch, "position": centre}
    return {
        "time": 0.0,
        "lower": np.zeros(3),
        "upper": np.array([nx * D, ny * D, nz * D]),
        "x": x,
        "v": np.zeros_like(x),
        "radius": np.full(len(x), D / 2),
        "density": DENSITY,
        "contacts": contacts | {"force": push},
    }


SCENE = {
    "gravity": [0.0, -G, 0.0],
    "periodic": np.array([1, 0, 1], np.int8),
    "wall_low": [np.nan, 0.0, np.nan],
    "wall_high": [np.nan] * 3,
}
