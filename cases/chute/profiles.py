"""Profiles over the height of a flow, from dumps of LAMMPS alone: what our maps are held against.

    python3 -m cases.chute.profiles FOLDER [FILE.csv]     # FOLDER has chute.dump, chute.local

Averages over slabs are exact in space: a sphere counts with the volume that lies in the slab, a
contact with the part of its branch that does. Compression is positive; z is measured from the
centres of the base's highest grains, where the slice was cut.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cases.provenance import about, head

SLAB = 0.5  # thickness of a slab [d]
DIAMETER, GRAVITY, ANGLE, DENSITY = 1e-3, 9.81, np.radians(26.0), 2500.0
COLUMNS = {
    "z": "height of the slab's middle [d]",
    "nu": "solid fraction, of the base too",
    "v": "velocity down the slope [sqrt(g d)]",
    "T": "granular temperature [g d]",
    "shear_rate": "[sqrt(g / d)]",
    "sigma_zz": "normal stress, contacts and fluctuations [rho g d]",
    "sigma_xz": "shear stress [rho g d]",
    "weight": "integral of nu g cos(angle) above [rho g d]",
    "drive": "integral of nu g sin(angle) above [rho g d]",
    "mu": "sigma_xz / sigma_zz",
    "share": "of fluctuations in the pressure",
}


def items(path: Path) -> Iterator[tuple[list[str], np.ndarray]]:
    """Frames of a dump: names of the columns, rows (N, columns)."""
    with open(path) as file:
        count = 0
        for line in file:
            if line.startswith("ITEM: NUMBER"):
                count = int(next(file))
            elif line.startswith(("ITEM: ATOMS", "ITEM: ENTRIES")):
                names = line.split()[2:]
                yield names, np.loadtxt(file, max_rows=count, ndmin=2)


def segment_of_sphere(z: np.ndarray, r: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Volumes (N, slabs) of spheres between planes."""
    h = np.clip((edges[None, :] - z[:, None]) / r[:, None], -1.0, 1.0)
    below = np.pi / 3.0 * r[:, None] ** 3 * (2.0 + 3.0 * h - h**3)
    return np.diff(below, axis=1)


def segment_of_branch(a: np.ndarray, b: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Shares (C, slabs) of the segments from heights a to b between planes."""
    low, high = np.minimum(a, b)[:, None], np.maximum(a, b)[:, None]
    reached = np.clip(edges[None, :], low, high) - low
    return np.diff(reached / np.maximum(high - low, 1e-300), axis=1)


def contact_stress(grains: dict, rows: np.ndarray, size: np.ndarray, edges: np.ndarray):
    """(slabs, 3, 3) [N m]: minus force times branch, by slab; checks forces by the grains' own."""
    rows = rows[np.any(rows[:, 3:9] != 0.0, axis=1)]
    place = {int(one): k for k, one in enumerate(grains["id"])}
    i, j = (np.array([place[int(one)] for one in rows[:, k]]) for k in (0, 1))
    force = rows[:, 3:6] + rows[:, 6:9]
    branch = grains["x"][i] - grains["x"][j]
    branch -= size * np.round(branch / size)
    total = np.zeros_like(grains["x"])
    np.add.at(total, i, force)
    np.add.at(total, j, -force)
    moves = grains["type"] == 1
    weight = grains["mass"][:, None] * GRAVITY * np.array([np.sin(ANGLE), 0.0, -np.cos(ANGLE)])
    wrong = np.abs(total + weight - grains["f"])[moves].max()
    # The grains' forces are of velocities half a step back, those of contacts of the step's own
    if wrong > 0.02 * np.abs(grains["f"]).max():
        raise SystemExit(f"the contacts' forces are not the grains' ({wrong:g} N)")
    part = segment_of_branch(grains["x"][i, 2], grains["x"][i, 2] - branch[:, 2], edges)
    return np.einsum("cs,ca,cb->sab", part, force, branch)


def read(folder: Path, size: np.ndarray) -> Iterator[tuple[dict, np.ndarray]]:
    """Grains by name, vectors (N, 3), and rows of contacts."""
    for (names, atoms), (_, rows) in zip(
        items(folder / "chute.dump"), items(folder / "chute.local")
    ):
        grains = dict(zip(names, atoms.T))
        for name, parts in {"x": "x y z", "v": "vx vy vz", "f": "fx fy fz"}.items():
            grains[name] = atoms[:, [names.index(part) for part in parts.split()]]
        yield grains, rows


def profiles(folder: Path) -> tuple[dict[str, np.ndarray], int]:
    """Columns of COLUMNS, each (slabs,), and how many frames they are the mean of."""
    d, g = DIAMETER, GRAVITY
    size = np.array([10.0 * d, 6.0 * d, 1e6 * d])  # the last repeats nowhere
    edges = d * SLAB * np.arange(-6, 49)
    volume = size[0] * size[1] * SLAB * d
    frames = list(read(folder, size))
    solid, moving, flow, contact = (np.zeros((len(edges) - 1, *s)) for s in ((), (), (3,), (3, 3)))
    for grains, rows in frames:
        part = segment_of_sphere(grains["x"][:, 2], grains["radius"], edges)
        moves = grains["type"] == 1
        solid += part.sum(axis=0)
        moving += part[moves].sum(axis=0)
        flow += part[moves].T @ grains["v"][moves]
        contact += contact_stress(grains, rows, size, edges)
    middle = 0.5 * (edges[1:] + edges[:-1])
    inside = moving > 1e-3 * volume * len(frames)
    mean = flow[inside] / moving[inside, None]
    kinetic = np.zeros_like(contact)
    for grains, _ in frames:
        moves = grains["type"] == 1
        z = grains["x"][moves, 2]
        own = np.stack([np.interp(z, middle[inside], mean[:, k]) for k in range(3)], axis=1)
        off = grains["v"][moves] - own
        part = segment_of_sphere(z, grains["radius"][moves], edges)
        kinetic += DENSITY * np.einsum("ns,na,nb->sab", part, off, off)
    count = len(frames)
    unit = DENSITY * g * d
    stress = {"k": kinetic / volume / count / unit, "c": contact / volume / count / unit}
    total = stress["k"] + stress["c"]
    pressure = {name: np.trace(one, axis1=1, axis2=2) for name, one in stress.items()}
    above = np.cumsum((moving / volume / count)[::-1])[::-1] * SLAB
    above -= 0.5 * moving / volume / count * SLAB  # at the middle
    with np.errstate(invalid="ignore", divide="ignore"):
        found = {
            "z": middle / d,
            "nu": solid / volume / count,
            "v": flow[:, 0] / moving / np.sqrt(g * d),
            "T": np.trace(kinetic, axis1=1, axis2=2) / (3.0 * DENSITY * moving) / (g * d),
            "sigma_zz": total[:, 2, 2],
            "sigma_xz": -total[:, 0, 2],
            "weight": above * np.cos(ANGLE),
            "drive": above * np.sin(ANGLE),
            "mu": -total[:, 0, 2] / total[:, 2, 2],
            "share": pressure["k"] / (pressure["k"] + pressure["c"]),
        }
    found["shear_rate"] = np.gradient(found["v"], SLAB)
    return {name: found[name][inside] for name in COLUMNS}, count


def main(words: list[str]) -> int:
    folder = Path(words[0])
    found, count = profiles(folder)
    version = next(line for line in open(folder / "log.lammps") if line.startswith("LAMMPS"))
    origin = about("lmp -in lammps.in; python3 -m cases.chute.profiles .", program=version.strip())
    notes = [f"{name}: {text}" for name, text in COLUMNS.items()]
    lines = [f"# {line}" for line in head(origin, f"mean of {count} frames", *notes)]
    lines += [",".join(found)]
    lines += [",".join(f"{value:.5g}" for value in row) for row in zip(*found.values())]
    text = "\n".join(lines) + "\n"
    if len(words) > 1:
        Path(words[1]).write_text(text)
    else:
        print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
