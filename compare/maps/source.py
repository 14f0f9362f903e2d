"""Files of grains or points to be mapped: what they tell of themselves, and what they lack."""

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from cases.case import parse
from cases.errors import CaseError
from cases.reading import attributes, opened
from cases.scenes import gravity_of

AXES = "xyz"


@dataclass(frozen=True)
class Source:
    """One file. `gravity` (3,) [m/s2], NaN where it is not told; `time` of frames [s], NaN where
    it is not told; `missing`: what it lacks, and what can therefore not be mapped.
    """

    path: Path
    engine: str
    title: str
    gravity: np.ndarray
    time: np.ndarray
    notes: list[str]
    missing: list[tuple[str, str]]

    @property
    def name(self) -> str:
        return self.path.stem

    def label(self, frame: int) -> str:
        """Of a frame, by its time where that is told."""
        return f"frame {frame}" if np.isnan(self.time[frame]) else f"t = {self.time[frame]:.4g} s"


def read(path: Path) -> Source:
    """Raises CaseError where the file is none of grains or points."""
    try:
        with opened(path) as f:
            steps = sorted(f["data"], key=int)
            if not steps:
                raise CaseError(f"{path}: no frames")
            told = attributes(f)
            engine = str(told["engine"])
            time = np.array([float(f[f"data/{step}"].attrs.get("time", np.nan)) for step in steps])
            notes = str(told.get("notes", "none"))
            frames = [f[f"data/{step}"] for step in steps]
            return Source(
                path,
                engine,
                str(told.get("engine_version", engine)),
                gravity(told, path),
                time,
                [] if notes == "none" else notes.splitlines(),
                missing(engine, frames, time),
            )
    except (KeyError, ValueError, TypeError, AttributeError, OSError) as error:
        why = " ".join(str(error).split())
        raise CaseError(f"{path}: no file of grains or points ({why})") from error


def gravity(told: dict, path: Path) -> np.ndarray:
    """Of the attributes of a file [m/s2]."""
    if "gravity" in told:
        return np.asarray(told["gravity"], dtype=float).reshape(3)
    if "case_resolved" in told:
        case = parse(str(told["case_resolved"]), path)
        pull, weight = gravity_of(case["geometry"])
        return np.array([pull, -weight, 0.0])
    return np.full(3, np.nan)


def missing(engine: str, frames: list, time: np.ndarray) -> list[tuple[str, str]]:
    """(what cannot be told, why)."""
    clouds = [frame["particles/cloud"] for frame in frames]
    out = []
    if engine == "dem":
        bare = sum("contacts" not in frame for frame in frames)
        if bare:
            which = "no contacts" if bare == len(frames) else f"no contacts in {bare} frames"
            out.append(
                (
                    "contact stress, pressure, stress ratio, inertial number, fabric, coordination",
                    which,
                )
            )
        else:
            with_walls = [frame for frame in frames if walls_told(frame)]
            if not with_walls:
                out.append(("the force of walls (interaction-force density)", "no wall contacts"))
            if all("dissipation" not in frame["contacts"] for frame in frames):
                out.append(("dissipation density", "contacts without a power"))
        if any("angular_velocity" not in cloud for cloud in clouds):
            out.append(("rotational temperature", "no angular velocity"))
    else:
        out += missing_of_points(clouds)
    if len(frames) == 1:
        out.append(("rates of change, averages over time", "one frame"))
    if np.isnan(time).any():
        out.append(("times of the frames", "not told in the file"))
    return out


def missing_of_points(clouds: list) -> list[tuple[str, str]]:
    """The same of material points."""
    lacking = {
        name: any(name not in cloud for cloud in clouds)
        for name in ("stress", "solid_volume", "volume", "void_ratio", "granular_temperature")
    }
    out = []
    if lacking["stress"]:
        out.append(("stress, pressure, stress ratio, inertial number", "points without a stress"))
    elif lacking["volume"] and (lacking["solid_volume"] or lacking["void_ratio"]):
        out.append(("stress, pressure, stress ratio, inertial number", "points without a volume"))
    if lacking["solid_volume"]:
        out.append(("solid fraction, void ratio", "points without a solid volume (--density)"))
    if lacking["granular_temperature"]:
        out.append(("granular temperature of the law", "points without one"))
    return out


def walls_told(frame: h5py.Group) -> bool:
    """Whether any contact of the frame is with a wall or a glued grain."""
    second = frame["contacts/second"][:]
    if (second < 0).any():
        return True
    cloud = frame["particles/cloud"]
    if "kind" not in cloud:
        return False
    glued = cloud["id"][:][cloud["kind"][:] == 3]
    return bool(np.isin(second, glued).any() or np.isin(frame["contacts/first"][:], glued).any())
