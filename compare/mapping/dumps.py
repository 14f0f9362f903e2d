"""Grains that grainpair did not simulate: plain text dumps of LIGGGHTS or LAMMPS, turned into a run
file.

Needs the columns id, x, y, z, vx, vy, vz and radius (or diameter); takes type and omegax, omegay,
omegaz where they are. The scene's axes are the project's: x along the flow, y up. Contacts are not
in such dumps, so the fields of stress are left out. The energy history is what positions and
velocities tell: kinetic, rotational, potential; what has gone is booked as dissipated, elastic
energy included.
"""

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from cases.case import Case
from cases.errors import CaseError

NEEDED = ("id", "x", "y", "z", "vx", "vy", "vz")


@dataclass(frozen=True)
class Snapshot:
    step: int
    columns: dict[str, np.ndarray]


def snapshots(path: Path) -> Iterator[Snapshot]:
    """The snapshots of a text dump, one by one; raises CaseError with the line that cannot be read."""
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
    rho, g = scene["grains.density"], scene["geometry.gravity"]
    fixed = glued(frames)
    history = {name: [] for name in ("time", "kinetic", "rotational", "potential")}
    with h5py.File(path, "w") as f:
        for key, value in {
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
            "engine_version": "dumps",
            "commit": "",
            "seed": -1,
            "case": scene.text,
            "case_resolved": scene.resolved,
            "command": "",
            "threads": 1,
            "cpu_seconds": float("nan"),
            "wall_seconds": float("nan"),
            "end_reason": "maximum",
            "time_scale": np.sqrt(scene["geometry.height"] / g),
        }.items():
            f.attrs[key] = value
        for frame in frames:
            c = frame.columns
            time = (frame.step - frames[0].step) * time_step
            group = f.create_group(f"data/{frame.step - frames[0].step}")
            group.attrs.update({"time": time, "dt": time_step, "timeUnitSI": 1.0})
            cloud = group.create_group("particles/cloud")
            vectors = {"position": ("m", "xyz"), "velocity": ("m/s", ("vx", "vy", "vz"))}
            if "omegax" in c:
                vectors["angular_velocity"] = ("1/s", ("omegax", "omegay", "omegaz"))
            for name, (unit, columns) in vectors.items():
                for component, column in zip("xyz", columns):
                    cloud[f"{name}/{component}"] = c[column]
                    cloud[f"{name}/{component}"].attrs["unit"] = unit
            volume = 4.0 / 3.0 * np.pi * c["radius"] ** 3
            cloud["id"], cloud["radius"] = c["id"].astype(np.int64), c["radius"]
            cloud["solid_volume"], cloud["mass"] = volume, rho * volume
            kind = np.where(np.isin(c["id"], fixed), 3, 1)
            cloud["kind"] = kind.astype(np.int8)

            moving = kind == 1
            mass = (rho * volume)[moving]
            speed2 = sum(c[k][moving] ** 2 for k in ("vx", "vy", "vz"))
            spin2 = (
                sum(c[k][moving] ** 2 for k in ("omegax", "omegay", "omegaz"))
                if "omegax" in c
                else 0.0
            )
            history["time"].append(time)
            history["kinetic"].append(0.5 * np.sum(mass * speed2))
            history["rotational"].append(0.2 * np.sum(mass * c["radius"][moving] ** 2 * spin2))
            history["potential"].append(g * np.sum(mass * c["y"][moving]))
        energy = {k: np.array(v) for k, v in history.items()}
        total = energy["kinetic"] + energy["rotational"] + energy["potential"]
        energy["dissipated"] = total[0] - total
        energy["unaccounted"] = np.zeros_like(total)
        for name, values in energy.items():
            f[f"energy/{name}"] = values
            f[f"energy/{name}"].attrs.update({"unit": "s" if name == "time" else "J", "doc": name})


def convert(paths: Iterable[Path], scene: Case, time_step: float, output: Path):
    """One run file from all snapshots of `paths`, in the order of their steps."""
    try:
        frames = sorted((s for path in paths for s in snapshots(path)), key=lambda s: s.step)
    except OSError as error:
        raise CaseError(f"{error.filename}: cannot be read ({error.strerror})") from error
    if not frames:
        raise CaseError("grainpair compare: the dumps hold no snapshot")
    part = output.with_name(output.name + ".part")
    try:
        write(frames, scene, time_step, part)
        os.replace(part, output)
    finally:
        part.unlink(missing_ok=True)
