"""Grains that grainpair did not simulate: plain text dumps of LIGGGHTS or LAMMPS, turned into a run
file.

Needs the columns id, x, y, z, vx, vy, vz and radius (or diameter); takes type and omegax, omegay,
omegaz where they are. The scene's axes are the project's: x along the flow, y up. Contacts are not
in such dumps, so the fields of stress are left out. The energy history is what positions and
velocities tell: kinetic, rotational, potential; what has gone is booked as dissipated, elastic
energy included.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from cases.case import Case
from cases.errors import CaseError
from cases.files import replacing
from compare.mapping.runs import GLUED

NEEDED = ("id", "x", "y", "z", "vx", "vy", "vz")
SPIN = ("omegax", "omegay", "omegaz")
MADE_BY = "dumps"  # the engine's version, as a run file of theirs says it
HELD = ("kinetic", "rotational", "potential")


@dataclass(frozen=True)
class Snapshot:
    step: int
    columns: dict[str, np.ndarray]


def snapshots(path: Path) -> Iterator[Snapshot]:
    """The snapshots of a text dump, one by one; raises CaseError with the line that cannot
    be read.
    """
    with open(path, errors="replace") as f:
        lines = enumerate(f, start=1)

        def expect(what: str) -> str:
            number, line = next(lines, (0, ""))
            if not line.startswith(f"ITEM: {what}"):
                raise CaseError(
                    f"{path}:{number}: expected 'ITEM: {what}' (not a text dump, or cut short)"
                )
            return line

        for number, line in lines:
            if not line.startswith("ITEM: TIMESTEP"):
                raise CaseError(
                    f"{path}:{number}: expected 'ITEM: TIMESTEP' (not a text dump of LIGGGHTS or "
                    "LAMMPS)"
                )
            step = int(next(lines)[1])
            expect("NUMBER OF ATOMS")
            count = int(next(lines)[1])
            expect("BOX BOUNDS")
            for _ in range(3):
                next(lines)
            names = expect("ATOMS").split()[2:]
            missing = [name for name in NEEDED if name not in names]
            if missing or not {"radius", "diameter"} & set(names):
                raise CaseError(
                    f"{path}: no column {', '.join(missing) or 'radius'} (has {', '.join(names)})"
                )
            rows = [next(lines, (0, ""))[1] for _ in range(count)]
            values = np.array(" ".join(rows).split(), dtype=float)
            if values.size != count * len(names):
                raise CaseError(
                    f"{path}: step {step} holds {values.size} numbers instead of "
                    f"{count * len(names)} (cut short?)"
                )
            table = values.reshape(count, len(names))
            table = table[np.argsort(table[:, names.index("id")])]
            columns = dict(zip(names, table.T))
            if "radius" not in columns:
                columns["radius"] = 0.5 * columns["diameter"]
            yield Snapshot(step, columns)


def glued(frames: list[Snapshot]) -> np.ndarray:
    """Ids of the grains that never move."""
    first, last = frames[0].columns, frames[-1].columns
    still = np.isin(first["id"], last["id"])
    for frame in frames:
        speed = sum(frame.columns[k] ** 2 for k in ("vx", "vy", "vz"))
        still &= np.isin(first["id"], frame.columns["id"][speed == 0.0])
    return first["id"][still] if len(frames) > 1 else np.array([])


def write(frames: list[Snapshot], scene: Case, time_step: float, path: Path):
    """A run file of `frames`, the first being the instant of release."""
    fixed = glued(frames)
    history: dict[str, list] = {name: [] for name in ("time", *HELD)}
    with h5py.File(path, "w") as f:
        f.attrs.update(attributes(scene))
        for frame in frames:
            step = frame.step - frames[0].step
            moving = ~np.isin(frame.columns["id"], fixed)
            group = f.create_group(f"data/{step}")
            group.attrs.update({"time": step * time_step, "dt": time_step, "timeUnitSI": 1.0})
            mass = write_cloud(
                group.create_group("particles/cloud"),
                frame.columns,
                moving,
                scene["grains.density"],
            )
            history["time"].append(step * time_step)
            held = energies(frame.columns, moving, mass, scene["geometry.gravity"])
            for name, value in zip(HELD, held):
                history[name].append(value)
        energy = {name: np.array(values) for name, values in history.items()}
        total = energy["kinetic"] + energy["rotational"] + energy["potential"]
        energy["dissipated"] = total[0] - total
        energy["unaccounted"] = np.zeros_like(total)
        for name, values in energy.items():
            f[f"energy/{name}"] = values
            f[f"energy/{name}"].attrs.update({"unit": "s" if name == "time" else "J", "doc": name})


def attributes(scene: Case) -> dict:
    """What a run file says of itself at its root."""
    return {
        "openPMD": "1.1.0",
        "openPMDextension": np.uint32(0),
        "basePath": "/data/%T/",
        "particlesPath": "particles/",
        "meshesPath": "meshes/",
        "iterationEncoding": "groupBased",
        "iterationFormat": "/data/%T/",
        "software": "grainpair",
        "schema_version": 1,
        "engine": "dem",
        "engine_version": MADE_BY,
        "commit": "",
        "seed": -1,
        "case": scene.text,
        "case_resolved": scene.resolved,
        "command": "",
        "threads": 1,
        "cpu_seconds": float("nan"),
        "cpu_seconds_engine": float("nan"),
        "wall_seconds": float("nan"),
        "end_reason": "maximum",
        "time_scale": np.sqrt(scene["geometry.height"] / scene["geometry.gravity"]),
    }


def write_cloud(cloud: h5py.Group, columns: dict, moving: np.ndarray, rho: float) -> np.ndarray:
    """Records of one snapshot, of grains of density rho [kg/m3]; returns their masses (N,) [kg]."""
    vectors = {"position": ("m", ("x", "y", "z")), "velocity": ("m/s", ("vx", "vy", "vz"))}
    if "omegax" in columns:
        vectors["angular_velocity"] = ("1/s", SPIN)
    for name, (unit, names) in vectors.items():
        for component, column in zip("xyz", names):
            cloud[f"{name}/{component}"] = columns[column]
            cloud[f"{name}/{component}"].attrs["unit"] = unit
    volume = 4.0 / 3.0 * np.pi * columns["radius"] ** 3
    mass = rho * volume
    cloud["id"], cloud["radius"] = columns["id"].astype(np.int64), columns["radius"]
    cloud["solid_volume"], cloud["mass"] = volume, mass
    cloud["kind"] = np.where(moving, 1, GLUED).astype(np.int8)
    return mass


def energies(columns: dict, moving: np.ndarray, mass: np.ndarray, g: float) -> list[float]:
    """HELD, of the grains that move [J]."""

    def squares(names) -> np.ndarray:
        return np.sum([columns[name][moving] ** 2 for name in names], axis=0)

    m, r, y = mass[moving], columns["radius"][moving], columns["y"][moving]
    spin2 = squares(SPIN) if "omegax" in columns else np.zeros_like(m)
    return [
        0.5 * np.sum(m * squares(("vx", "vy", "vz"))),
        0.2 * np.sum(m * r**2 * spin2),
        g * np.sum(m * y),
    ]


def convert(paths: Iterable[Path], scene: Case, time_step: float, output: Path):
    """One run file from all snapshots of `paths`, in the order of their steps."""
    try:
        frames = sorted((s for path in paths for s in snapshots(path)), key=lambda s: s.step)
    except OSError as error:
        raise CaseError(f"{error.filename}: cannot be read ({error.strerror})") from error
    if not frames:
        raise CaseError("grainpair compare: the dumps hold no snapshot")
    with replacing(output) as part:
        write(frames, scene, time_step, part)
