"""One side of a comparison in time, as the player shows it: places and values of its particles."""

from dataclasses import dataclass, field

import numpy as np

from compare.mapping.clouds import StoredClouds
from compare.mapping.reductions import has_temperature, surface
from compare.mapping.runs import Run, about_axis
from compare.report.player.packing import thinning

SIDES = {"mpm": ("Continuum (MPM)", "point"), "dem": ("Grains (DEM)", "grain")}
OVERLAP = 1.5  # of points, which else gape where the flow stretches what they cover
SEED = 1  # of the draw of the particles that are kept, the same for every report
MAPPED = ("void_ratio", "granular_temperature", "pressure")  # what grains take from their cell


@dataclass(frozen=True)
class Track:
    """A side at `time` (F,) [s].

    x (F, N, 3) [m], NaN where a particle is not in a frame; `values` by name, each (F, N) in SI
    units, NaN where one is not known; `size` (N,), the radius of a grain or half the side of a
    point [m]; `ids` (N,), or None where the file has none; `surface` (F, columns), heights of the
    free surface [m] above `columns` [m]. `unknown`: why a quantity is missing, by its name.
    `followed`: whether a row is one particle in all frames. `kept`: of how many frames, of how many
    particles one is here.
    """

    engine: str
    time: np.ndarray
    x: np.ndarray
    values: dict[str, np.ndarray]
    size: np.ndarray
    ids: np.ndarray | None
    columns: np.ndarray
    surface: np.ndarray
    unknown: dict[str, str] = field(default_factory=dict)
    followed: bool = True
    kept: tuple[int, int] = (1, 1)


@dataclass(frozen=True)
class Rows:
    """Where the particles of a frame stand in the arrays of a track: those in `order` of the
    frame's go to `rows`.
    """

    order: np.ndarray
    rows: np.ndarray


def kept_frames(count: int, stride: int) -> list[int]:
    """Every `stride`-th frame, and the last."""
    return sorted({*range(0, count, stride), count - 1})


def drawn(count: int, stride: int) -> np.ndarray:
    """One in `stride` of `count` rows, in their order: drawn, since every n-th of a lattice would
    be one of its lines.
    """
    chosen = np.random.default_rng(SEED).permutation(count)[: -(-count // stride)]
    return np.sort(chosen)


def stored(run: Run) -> StoredClouds:
    """The frames of a run's file. Raises TypeError for a run that is of none."""
    if not isinstance(run.clouds, StoredClouds):
        raise TypeError(f"{run.name}: its frames are not those of a file")
    return run.clouds


def size_of(run: Run) -> tuple[int, int]:
    """Frames of a run, and the particles of its first."""
    return len(run.time), len(run.clouds[0].mass)


def read(run: Run, allowed: int) -> Track:
    """The track of a run whose fields are mapped, of about `allowed` particles times frames.

    Reads one frame at a time. Raises CaseError where a frame cannot be read.
    """
    kept = thinning(*size_of(run), allowed)
    frames = kept_frames(len(run.time), kept[0])
    ids, rows, followed = followed_rows(run, frames, kept[1])
    count = len(ids) if ids is not None else 1 + max(int(r.rows.max(initial=-1)) for r in rows)
    x = np.full((len(frames), count, 3), np.nan, np.float32)
    values: dict[str, np.ndarray] = {}
    size = np.full(count, np.nan)
    for k, (frame, at) in enumerate(zip(frames, rows)):
        cloud = run.clouds[frame]
        x[k, at.rows] = cloud.x[at.order]
        for name, found in known_values(run, frame).items():
            held = values.setdefault(name, np.full((len(frames), count), np.nan, np.float32))
            held[k, at.rows] = found[at.order]
        new = np.isnan(size[at.rows])
        size[at.rows[new]] = sizes(run, frame)[at.order][new]
    values = {name: held for name, held in values.items() if np.isfinite(held).any()}
    if run.engine == "mpm":
        size *= np.sqrt(kept[1])  # fewer points cover the same area
    return Track(
        run.engine,
        run.time[frames],
        x,
        values,
        size,
        ids,
        run.fields.grid.x,
        np.array([surface(run, frame) for frame in frames]),
        reasons(run, values),
        followed,
        kept,
    )


def followed_rows(
    run: Run, frames: list[int], stride: int
) -> tuple[np.ndarray | None, list[Rows], bool]:
    """The ids (N,) that are kept, the rows that the particles of each frame get, and whether a row
    is one particle. Without ids a row is one as long as frames have the same number of them.
    """
    told = [stored(run).records(frame, ["id"]) for frame in frames]
    found = [records["id"] for records in told if "id" in records]
    if len(found) < len(frames):
        counts = [len(run.clouds[frame].mass) for frame in frames]
        chosen = drawn(max(counts), stride)
        at = [chosen[chosen < count] for count in counts]
        return None, [Rows(rows, np.arange(len(rows))) for rows in at], len(set(counts)) == 1
    every = np.unique(np.concatenate(found))
    ids = every[drawn(len(every), stride)]
    rows = []
    for now in found:
        order = np.flatnonzero(np.isin(now, ids))
        rows.append(Rows(order, np.searchsorted(ids, now[order])))
    return ids, rows, True


def known_values(run: Run, frame: int) -> dict[str, np.ndarray]:
    """Values (N,) by name of what moves in a frame [SI units].

    Material points tell their own state. Grains know their speed; void ratio, granular temperature
    and pressure are those of the mapped cell that they lie in.
    """
    cloud = run.clouds[frame]
    out = {"speed": np.linalg.norm(cloud.v, axis=1)}
    if run.engine == "dem":
        for name in MAPPED:
            if name in run.fields and (name != "pressure" or "contact_stress" in run.fields):
                out[name] = run.fields.at(name, frame, cloud.x)
        return out
    for name in ("void_ratio", "pressure", "regime"):
        if name in cloud.state:
            out[name] = cloud.state[name]
    if has_temperature(run):
        out |= stored(run).records(frame, ["granular_temperature"])
    return out


def sizes(run: Run, frame: int) -> np.ndarray:
    """Radii of grains, or half the sides (N,) [m] of the squares that material points are drawn as:
    of the solid volume with the case's voids, through the thickness where all lie in one plane,
    and OVERLAP times as wide.
    """
    cloud = run.clouds[frame]
    if run.engine == "dem":
        return np.cbrt(cloud.solid_volume / (4.0 / 3.0 * np.pi))
    volume = np.where(np.isnan(cloud.solid_volume), cloud.mass, cloud.solid_volume)
    if np.isnan(cloud.solid_volume).any():
        volume = volume / run.case["grains.density"]
    volume = volume * (1.0 + run.case["initial.void_ratio"])
    if about_axis(run.case):  # rings, as far as a quarter goes round
        return 0.5 * OVERLAP * np.sqrt(volume / (0.5 * np.pi * cloud.x[:, 0]))
    if np.ptp(cloud.x[:, 2]) == 0.0:
        return 0.5 * OVERLAP * np.sqrt(volume / run.case["geometry.thickness"])
    return 0.5 * OVERLAP * np.cbrt(volume)


def reasons(run: Run, values: dict[str, np.ndarray]) -> dict[str, str]:
    """Why a side lacks a quantity, by its name, in words that follow "not known: "."""
    if run.engine == "dem":
        why = {"regime": "grains have none", "pressure": "the file has no contacts"}
        other = "not mapped from these grains"
    else:
        law = run.case.values.get("material", {}).get("law")
        why = (
            {"granular_temperature": f"the law {law} has none"} if law and not run.imported else {}
        )
        other = "the file does not tell it"
    return {name: why.get(name, other) for name in (*MAPPED, "regime") if name not in values}
