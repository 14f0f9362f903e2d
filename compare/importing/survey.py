"""What the frames of a file have in common: units, order, walls, axes, places, times."""

from dataclasses import dataclass

import numpy as np

from cases.case import Case
from cases.errors import CaseError
from compare.importing import axes, merge, places, truth, units, walls
from compare.importing.frame import Box
from compare.importing.options import Options
from compare.importing.series import Grains, Series
from compare.importing.spool import Piece, Spool
from dem_reference.grains import mapped_diameter

GRAVITY = 9.81  # m/s2


@dataclass
class Scene:
    """What is the same in every frame. `axes` with our origin; `walls_low`, `walls_high` (3,) [m]
    and `gravity` (3,) [m/s2] in our axes; `wall` are the ids of wall grains.
    """

    series: Series
    contacts: list[Piece]
    wall: np.ndarray
    axes: axes.Axes
    low: np.ndarray
    high: np.ndarray
    gravity: np.ndarray
    matter: truth.Matter
    sizes: truth.Sizes
    times: np.ndarray
    made_by: str


def survey(
    spool: Spool, options: Options, scene: Case | None, made_by: str, notes: list[str]
) -> Scene:
    """What the frames have in common."""
    series = series_of(spool, options, scene, notes)
    first = series[0]
    wall = walls.ids(series, options.walls, notes)
    matter = truth.matter(first, options.density, scene, notes)
    moving = ~np.isin(first.ids, wall)
    sizes = truth.Sizes.of(first.radius[moving], matter.masses(first)[moving])
    if scene is not None:  # before what hangs on lengths
        truth.refuse_other_scene(
            "diameter", sizes.d43, mapped_diameter(scene["grains"]), first.source
        )

    gravity = None if options.gravity is None else np.array(options.gravity)
    turned = axes.chosen(
        seen(series, wall, sizes.d43),
        options.up,
        options.flow,
        gravity,
        None if scene is None else truth.column(scene),
        first.source,
        notes,
    )
    if gravity is None:
        gravity = -(GRAVITY if scene is None else scene["geometry.gravity"]) * turned.turn[1]
    placed, edges, low, high = located(series, wall, turned, sizes.d43, options, scene, notes)
    times = times_of(series, options.time_step, scene, notes)
    if scene is not None:
        span = float(times[-1]) if len(series) > 1 else None
        here = None if first.box is None else placed.box(first.box)
        size = extent(edges.low, edges.high, here)
        truth.against_case(sizes, size, span, scene, first.source, notes)
    return Scene(
        series,
        [piece for piece in spool.pieces if not piece.columns and piece.contacts is not None],
        wall,
        placed,
        low,
        high,
        placed.vectors(gravity),
        matter,
        sizes,
        times,
        made_by,
    )


def series_of(spool: Spool, options: Options, scene: Case | None, notes: list[str]) -> Series:
    """The instants in order and in SI; says what they lack."""
    pieces = [piece for piece in spool.pieces if piece.columns and piece.count]
    if not pieces:
        raise CaseError(f"{options.files[0]}: no grains (in no frame)")
    unit = units.chosen(
        [(piece.source, piece.units) for piece in spool.pieces],
        options.units,
        options.scales,
        notes,
    )
    diameter = options.diameter or (scene["grains.diameter"] if scene else None)
    box = None
    if all(piece.box is None for piece in pieces):
        box = next((piece.box for piece in spool.pieces if piece.box is not None), None)
        if box is not None:
            notes.append("assumed: the box is that of the contacts' file (the grains' has none)")
    series = Series(spool, merge.instants(spool, pieces, notes), unit, diameter, box)
    told = {piece.step for piece in spool.pieces if piece.columns}
    if bare := len(told - {piece.step for piece in pieces}):
        notes.append(f"dropped: {bare} frames without grains")
    first = series[0]
    if "radius" not in pieces[0].columns:
        notes.append(f"assumed: all diameters are {diameter:g} m (the file has no radii)")
    if first.velocity is None and scene is not None:
        raise CaseError(f"{first.source}: no column vx, vy, vz (a comparison needs velocities)")
    if first.velocity is None:
        notes.append(
            "assumed: velocities are zero (the file has none): what needs them means nothing"
        )
    if series.first_id == 0:
        notes.append("turned: ids start at 1 here, at 0 in the file")
    return series


def seen(series: Series, wall: np.ndarray, grain: float) -> axes.Seen:
    """What tells where up is."""
    first = series[0]
    moving = ~np.isin(first.ids, wall)
    place, radius = first.place[moving], first.radius[moving, None]
    moved = None
    if len(series) > 1:
        last = series[-1]
        rows, there = walls.located(first.ids[moving], last.ids)
        now, then = (one.place if one.way is None else one.way for one in (last, first))
        if there.any():
            weight = radius[there] ** 3
            away = (now[rows] - then[moving])[there]
            moved = np.sum(weight * away, axis=0) / weight.sum()
    periodic = np.zeros(3, bool) if first.box is None else np.asarray(first.box.periodic, bool)
    if moved is not None and first.way is None:
        moved = np.where(periodic, 0.0, moved)
    return axes.Seen(
        extent((place - radius).min(axis=0), (place + radius).max(axis=0), first.box),
        moved,
        grain,
        np.array([is_below(place[:, k], first.place[~moving, k]) for k in range(3)]),
        periodic,
    )


def extent(low: np.ndarray, high: np.ndarray, box: Box | None) -> np.ndarray:
    """How far grains from `low` to `high` reach (3,) [m]: where the domain repeats, its length."""
    if box is None:
        return high - low
    return np.where(np.asarray(box.periodic, bool), box.upper - box.lower, high - low)


def is_below(moving: np.ndarray, wall: np.ndarray) -> bool:
    """Whether wall grains lie below the others along an axis: nine of ten, below 99 of 100."""
    if not len(wall):
        return False
    return bool(np.mean(wall < np.quantile(moving, 0.01)) > 0.9)


def edges_of(series: Series, wall: np.ndarray, turned: axes.Axes) -> places.Edges:
    """Where the grains that move begin and end, in the first frame and in the last one too."""
    low, high = [], []
    glued = None
    for k in sorted({0, len(series) - 1}):
        grains: Grains = series[k]
        moving = ~np.isin(grains.ids, wall)
        place, radius = turned.places(grains.place), grains.radius[:, None]
        low.append((place - radius)[moving].min(axis=0, initial=np.inf))
        high.append((place + radius)[moving].max(axis=0, initial=-np.inf))
        if k == 0 and is_below(place[moving, 1], place[~moving, 1]):
            glued = float((place + radius)[~moving, 1].max())
    return places.Edges(low[0], high[0], np.min(low, axis=0), np.max(high, axis=0), glued)


def located(
    series: Series,
    wall: np.ndarray,
    turned: axes.Axes,
    grain: float,
    options: Options,
    scene: Case | None,
    notes: list[str],
) -> tuple[axes.Axes, places.Edges, np.ndarray, np.ndarray]:
    """Axes with their origin, the grains' edges and the plane walls."""
    box = series[0].box
    if options.origin is not None:
        turned = axes.Axes(turned.turn, np.array(options.origin))
    here: Box | None = None if box is None else turned.box(box)
    if box is not None and here is not None and np.sum(here.periodic) < np.sum(box.periodic):
        notes.append(
            "dropped: a tilted box repeats here only along those of its edges that are axes"
        )
    edges = edges_of(series, wall, turned)
    low, high = places.walls(edges, here, grain)
    if scene is None:
        return turned, edges, low, high
    if options.origin is None:
        by = places.origin(edges, here, low, grain, turned, series[0].source, notes)
        turned = axes.Axes(turned.turn, turned.turn.T @ by)
        edges = places.moved(edges, by)
        high = high - by
    return turned, edges, np.array([0.0, 0.0, np.nan]), high


def times_of(
    series: Series, time_step: float | None, scene: Case | None, notes: list[str]
) -> np.ndarray:
    """Times of the frames [s], NaN where nobody tells them; of a case's grains since the first one.
    Raises CaseError where a case needs them, or they do not grow.
    """
    told = [None if one.time is None else series.units.time * one.time for one in series.instants]
    steps = np.array([one.step for one in series.instants], float)
    if any(one.pieces[0].step is None for one in series.instants) and time_step is not None:
        raise CaseError("--time-step: of frames without a step (nothing to multiply)")
    if all(time is not None for time in told):
        times = np.array(told, float)
        if time_step is not None and len(times) > 1:
            own = (times[-1] - times[0]) / (steps[-1] - steps[0])
            truth.disagree("time step", own, time_step, " s", "--time-step", notes)
    elif time_step is not None:
        times = time_step * steps
    elif len(series) == 1:
        times = np.array([np.nan])
    elif scene is not None:
        raise CaseError(
            f"{series.instants[0].source}: frames without a time (nothing to compare at) give "
            "--time-step"
        )
    else:
        notes.append("absent: times of the frames (--time-step tells them)")
        times = np.full(len(series), np.nan)
    if np.any(np.diff(times) <= 0.0):
        k = int(np.argmax(np.diff(times) <= 0.0)) + 1
        raise CaseError(
            f"{series.instants[k].source}: its time is not after that of the frame before"
        )
    if len(series) == 1:
        notes.append("absent: all that needs several frames (there is one)")
    since_first = scene is not None and len(series) > 1
    return times - times[0] if since_first else times
