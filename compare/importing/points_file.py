"""Material points of other programs, turned into a run file of the continuum (CONTRIBUTING.md): the
records that their files tell and no others. The energy history has what positions and velocities
tell; what has been dissipated nobody knows.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cases import openpmd
from cases.case import Case
from cases.errors import CaseError
from cases.files import replacing
from compare.importing import inputs, points, registry
from compare.importing.frame import VECTORS, Frame

DOCS = {
    "time": "time",
    "kinetic": "of the points' velocities",
    "potential": "of the points, zero at y = 0",
}
UNITS = {
    "id": "-",
    "position": "m",
    "velocity": "m/s",
    "mass": "kg",
    "solid_volume": "m3",
    "volume": "m3",
    "void_ratio": "-",
    "granular_temperature": "m2/s2",
    "stress": "Pa",
}
RISE = 0.01  # of the potential energy at the start: what an elastic rebound may add
FAR = 1e-6  # of the extent: parts of a step whose points are farther apart are not the same points


@dataclass
class PointOptions:
    """What a command line says of points. `tension`: whether tension is positive in the files (None
    where their formats settle it); `density` [kg/m3] of the solid, `diameter` [m] of its grains;
    `turn` (3, 3), whose rows are our axes in the files' ones (`up_told`: and the user gave them),
    `origin` (3,) [m] likewise; `gravity` (3,) [m/s2] in our axes.
    """

    tension: bool | None = None
    case: Case | None = None
    density: float | None = None
    diameter: float | None = None
    time_step: float | None = None
    turn: np.ndarray = field(default_factory=lambda: np.eye(3))
    origin: np.ndarray = field(default_factory=lambda: np.zeros(3))
    gravity: np.ndarray | None = None
    up_told: bool = False
    format: str = ""
    sources: tuple[str, ...] = ()
    notes: list[str] = field(default_factory=list)

    @property
    def solid_density(self) -> float | None:
        """Of the command line, else of the case [kg/m3]."""
        if self.density is None and self.case is not None:
            return float(self.case["grains.density"])
        return self.density

    def pull(self) -> np.ndarray:
        """Gravity (3,) [m/s2] in our axes."""
        if self.gravity is not None:
            return self.gravity
        g = 9.81 if self.case is None else self.case["geometry.gravity"]
        return np.array([0.0, -g, 0.0])


def convert(
    paths: Sequence[Path],
    options: PointOptions,
    output: Path,
    name: str | None = None,
    reading: dict | None = None,
) -> list[str]:
    """Writes the points of files as `output`, which appears complete or not at all; returns the
    notes. `name` is that of a format, `reading` what readers are told. Raises CaseError for what
    cannot be read or is not plausible.
    """
    known = registry.readers()
    if name is not None and (name not in known or known[name].holds != "points"):
        some = ", ".join(one.name for one in known.values() if one.holds == "points")
        raise CaseError(f"--format {name}: not a format of points ({some})")
    paths, passed = inputs.files(paths, ("points",), name)
    options.notes += passed
    chosen = {
        path: known[name] if name else registry.reader_of(path, ("points",)) for path in paths
    }
    options.format = "; ".join(dict.fromkeys(reader.doc for reader in chosen.values()))
    options.sources = tuple(str(path) for path in paths)
    told = dict(reading or {}) | {"notes": options.notes}
    frames = (one for path in in_order(paths) for one in chosen[path].frames(path, told))
    write_points(frames, options, output)
    return options.notes


def in_order(paths: Iterable[Path]) -> list[Path]:
    """Files by the step in their names, those of one step together."""
    return sorted(paths, key=lambda path: (points.step_of(path) or 0, path.name))


def write_points(frames: Iterable[Frame], options: PointOptions, path: Path):
    """A run file at `path` from frames in the order of their steps. Raises CaseError where
    positions, velocities or masses are missing or no numbers, or nobody tells the stresses' sign.
    """
    history: dict[str, list[float]] = {name: [] for name in DOCS}
    with replacing(path) as part, openpmd.create(part, "mpm", attributes(options)) as file:
        last = -np.inf
        for number, frame in enumerate(joined(frames)):
            step = number if frame.step is None else frame.step
            time = time_of(frame, options)
            if time <= last:
                raise CaseError(
                    f"{frame.source}: time {time:g} s is not after that of the frame before "
                    f"({last:g} s) give the files in their order, and --time-step"
                )
            last = time
            if step < 0 or f"data/{step}" in file:
                raise CaseError(
                    f"{frame.source}: step {step} {'again' if step >= 0 else '(negative)'} give "
                    "the files in their order"
                )
            records = records_of(frame, options)
            group = openpmd.frame(file, step, time, options.time_step or np.nan)
            cloud = group.create_group("particles/cloud")
            for name, values in records.items():
                kind = np.uint64 if name == "id" else np.float64
                openpmd.record(cloud, name, values, UNITS[name], kind)
            openpmd.offset(cloud, len(records["id"]))
            add(history, time, records, options.pull())
        if not history["time"]:
            raise CaseError(f"{path}: no frames to write")
        refuse_rising(history, options, path)
        rows = {
            name: (np.array(values), "s" if name == "time" else "J", DOCS[name])
            for name, values in history.items()
        }
        openpmd.history(file, rows)
        openpmd.describe(file, notes="\n".join(options.notes) or "none")


def refuse_rising(history: dict[str, list[float]], options: PointOptions, path: Path):
    """Raises CaseError where y was taken for up without being told, and the points rise."""
    rise = history["potential"][-1] - history["potential"][0]
    if rise > max(history["kinetic"][0], 0.0) + RISE * abs(history["potential"][0]):
        if not options.up_told:
            raise CaseError(
                f"{path}: y is not up (the points would gain {rise:.3g} J of potential energy) "
                "give --up z, or --up y if it is"
            )


def joined(frames: Iterable[Frame]) -> Iterator[Frame]:
    """Frames, those of one step that hold other columns of the same points made one."""
    kept: Frame | None = None
    for frame in frames:
        if kept is not None and frame.step is not None and kept.step == frame.step:
            kept = joint(kept, frame)
            continue
        if kept is not None:
            yield kept
        kept = frame
    if kept is not None:
        yield kept


def joint(one: Frame, other: Frame) -> Frame:
    """Two parts of one step; raises CaseError where they are of other points."""
    count, size = len(one.columns["x"]), len(other.columns["x"])
    if count == size:
        places = [np.stack([part.columns[axis] for axis in "xyz"]) for part in (one, other)]
        far = FAR * max(float(np.ptp(places[0])), 1e-300)
        if np.abs(places[0] - places[1]).max(initial=0.0) <= far:
            columns = other.columns | one.columns
            for part in (one, other):  # numbers of rows give way to ids that are told
                if not np.array_equal(part.columns["id"], np.arange(1, count + 1)):
                    columns["id"] = part.columns["id"]
            signs = {part.compression for part in (one, other)} - {None}
            time = other.time if one.time is None else one.time
            return Frame(
                one.source,
                columns,
                one.step,
                time,
                one.box,
                one.units,
                None,
                next(iter(signs), None),
            )
    apart = not np.isin(one.columns["id"], other.columns["id"]).any()
    if apart and one.columns.keys() == other.columns.keys() and one.time == other.time:
        columns = {k: np.concatenate([v, other.columns[k]]) for k, v in one.columns.items()}
        return Frame(
            one.source, columns, one.step, one.time, one.box, one.units, None, one.compression
        )
    raise CaseError(
        f"{other.source}: step {one.step} again, with other points than {one.source} leave one out"
    )


def time_of(frame: Frame, options: PointOptions) -> float:
    """[s]; raises CaseError where neither the file nor --time-step tells it."""
    if frame.time is not None:
        return frame.time
    if options.time_step is not None and frame.step is not None:
        return frame.step * options.time_step
    raise CaseError(f"{frame.source}: no time give --time-step S")


def attributes(options: PointOptions) -> dict:
    """What the file says of itself at its root, besides what all do."""
    told = {
        "engine_version": options.format or "points of another program",
        "source": "\n".join(options.sources) or "unknown",
        "gravity": options.pull(),
        "seed": -1,
        "command": "unknown",
        "threads": 1,
        "end_reason": "maximum",
    }
    told |= {name: np.nan for name in ("cpu_seconds", "cpu_seconds_engine", "wall_seconds")}
    scene = options.case
    if scene is not None:
        scale = float(np.sqrt(scene["geometry.height"] / scene["geometry.gravity"]))
        told |= {"case": scene.text, "case_resolved": scene.resolved, "time_scale": scale}
    if options.solid_density is not None:
        told["density"] = options.solid_density
    if options.diameter is not None:
        told["diameter"] = options.diameter
    return told


def records_of(frame: Frame, options: PointOptions) -> dict[str, np.ndarray]:
    """Records by name, in our axes: (N,), (N, 3), stress (N, 6) compression positive."""
    columns = frame.columns
    if frame.units not in (None, "si"):
        raise CaseError(f"{frame.source}: units {frame.units} (points are read in SI)")
    for name in ("position", "velocity"):
        lacking = [column for column in VECTORS[name] if column not in columns]
        if lacking:
            raise CaseError(f"{frame.source}: no {name} (lacks {', '.join(lacking)})")
    records = {"id": columns["id"]}
    place = np.stack([columns[name] for name in VECTORS["position"]], axis=1)
    records["position"] = (place - options.origin) @ options.turn.T
    velocity = np.stack([columns[name] for name in VECTORS["velocity"]], axis=1)
    records["velocity"] = velocity @ options.turn.T
    records["mass"] = mass_of(frame)
    solid = solid_volume_of(columns, records["mass"], options.solid_density)
    if solid is not None:
        records["solid_volume"] = solid
    if "volume" in columns:
        records["volume"] = columns["volume"]
    if "void_ratio" in columns:
        records["void_ratio"] = columns["void_ratio"]
    elif solid is not None and "volume" in columns:
        records["void_ratio"] = columns["volume"] / solid - 1.0
    if "temperature" in columns:
        records["granular_temperature"] = columns["temperature"]
    stress = stress_of(frame, options)
    if stress is not None:
        records["stress"] = stress
    checked(frame, records)
    order = np.argsort(records["id"], kind="stable")  # a point keeps its row
    return {name: values[order] for name, values in records.items()}


def mass_of(frame: Frame) -> np.ndarray:
    """(N,) [kg]: told, or bulk density times volume."""
    columns = frame.columns
    if "mass" in columns:
        return columns["mass"]
    if {"density", "volume"} <= columns.keys():
        return columns["density"] * columns["volume"]
    raise CaseError(f"{frame.source}: no masses, nor densities and volumes")


def solid_volume_of(
    columns: dict[str, np.ndarray], mass: np.ndarray, density: float | None
) -> np.ndarray | None:
    """(N,) [m3]: of volume and void ratio, or of the solid's density; None if neither is told."""
    if {"volume", "void_ratio"} <= columns.keys():
        return columns["volume"] / (1.0 + columns["void_ratio"])
    return None if density is None else mass / density


def stress_of(frame: Frame, options: PointOptions) -> np.ndarray | None:
    """(N, 6) [Pa] in our axes, compression positive; None where a component is missing."""
    columns, names = frame.columns, VECTORS["stress"]
    if not any(name in columns for name in names):
        return None
    lacking = [name for name in names if name not in columns]
    if lacking:
        text = f"stress left out: no component {', '.join(lacking)}"
        if text not in options.notes:
            options.notes.append(text)
        return None
    tension = options.tension
    if tension is None:
        if frame.compression is None:
            raise CaseError(
                f"{frame.source}: which sign has stress? (the format does not tell) give "
                "--tension-positive or --compression-positive"
            )
        tension = not frame.compression
    xx, yy, zz, xy, yz, zx = (columns[name] for name in names)
    rows = [np.stack(row, axis=-1) for row in ((xx, xy, zx), (xy, yy, yz), (zx, yz, zz))]
    turned = options.turn @ np.stack(rows, axis=-2) @ options.turn.T
    six = [turned[:, a, b] for a, b in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))]
    return np.stack(six, axis=1) * (-1.0 if tension else 1.0)


def checked(frame: Frame, records: dict[str, np.ndarray]):
    """Raises CaseError, with a point's id, where a record is no number, or none that can be."""
    ids, counts = np.unique(records["id"], return_counts=True)
    if len(ids) and ids[0] < 0:
        raise CaseError(f"{frame.source}: id {ids[0]} (below zero)")
    if counts.max(initial=1) > 1:
        raise CaseError(f"{frame.source}: id {ids[counts > 1][0]} more than once")
    for name, values in records.items():
        bad = ~np.isfinite(values.reshape(len(values), -1)).all(axis=1)
        if name in ("mass", "solid_volume", "volume"):
            bad |= ~(values > 0.0)
        if name in ("void_ratio", "granular_temperature"):
            bad |= values < 0.0
        if bad.any():
            where = int(np.flatnonzero(bad)[0])
            raise CaseError(
                f"{frame.source}: {name} {values[where]} of point {records['id'][where]}"
            )


def add(history: dict[str, list[float]], time: float, records: dict, gravity: np.ndarray):
    """A row of the energy history."""
    mass = records["mass"]
    history["time"].append(time)
    history["kinetic"].append(float(0.5 * np.sum(mass * np.sum(records["velocity"] ** 2, axis=1))))
    history["potential"].append(float(-np.sum(mass * (records["position"] @ gravity))))
