"""The second pass: each frame turned into our axes, checked and written."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from cases.case import Case
from compare.importing import plausible
from compare.importing.axes import Axes
from compare.importing.contacts import Contacts, Joiner
from compare.importing.energies import Ledger
from compare.importing.grains_file import GrainsFile
from compare.importing.progress import Progress
from compare.importing.series import Grains
from compare.importing.survey import Scene


def write(
    found: Scene,
    scene: Case | None,
    files: Sequence[Path],
    path: Path,
    notes: list[str],
    shown: Progress,
):
    """The file of all frames; adds to the notes what is odd in them."""
    file = GrainsFile(path)
    try:
        deep = frames(file, found, scene, notes, shown)
        box = found.series[0].box
        periodic = np.zeros(3, np.int8) if box is None else found.axes.box(box).periodic
        file.describe(
            engine_version=found.made_by,
            source="\n".join(str(one) for one in files),
            notes="\n".join(notes) or "none",
            gravity=found.gravity,
            diameter=found.sizes.d43,
            density=found.sizes.density,
            diameter_min=found.sizes.smallest,
            diameter_max=found.sizes.largest,
            largest_overlap=deep,
            periodic=periodic.astype(np.int8),
            wall_low=found.low,
            wall_high=found.high,
        )
        if scene is not None:
            file.scene(scene)
    finally:
        file.close()


def frames(
    file: GrainsFile, found: Scene, scene: Case | None, notes: list[str], shown: Progress
) -> float:
    """All frames and the energy history; returns the deepest overlap in the first and last [d]."""
    series = found.series
    ledger = Ledger(pull(found, notes))
    joiner = Joiner(
        series.spool,
        series.units,
        found.contacts,
        series.instants,
        in_file_axes(found),
        1 if series.first_id == 0 else 0,
        notes,
    )
    dt = step_of(found)
    first = series.instants[0].step if scene is not None else 0
    dense, deep = 0.0, 0.0
    for k, grains in enumerate(series):
        wall = np.isin(grains.ids, found.wall)
        if k in (0, len(series) - 1):
            dense = max(dense, plausible.densest(grains.place, grains.radius, wall))
            deep = max(deep, plausible.deepest(grains.place, grains.radius, wall, grains.box))
        one_frame(file, grains, found, wall, grains.step - first, k, dt, ledger)
        contacts = joiner.of(k, grains)
        if contacts is not None:
            file.contacts(grains.step - first, turned(contacts, found.axes))
        shown.written(k + 1, len(series))
    rows = ledger.history()
    file.history(rows)
    tell(ledger, rows, dense, deep, found, notes)
    return deep


def one_frame(
    file: GrainsFile,
    grains: Grains,
    found: Scene,
    wall: np.ndarray,
    step: int,
    k: int,
    dt: float,
    ledger: Ledger,
) -> None:
    """A frame's grains, and what they hold of energy."""
    axes, mass = found.axes, found.matter.masses(grains)
    place = axes.places(grains.place)
    still = np.zeros_like(place)
    vectors = {
        "position": place,
        "velocity": still if grains.velocity is None else axes.vectors(grains.velocity),
    }
    if grains.spin is not None:
        vectors["angular_velocity"] = axes.vectors(grains.spin)
    scalars = {"mass": mass, "solid_volume": grains.volume, "radius": grains.radius}
    if grains.type is not None:
        scalars["type"] = grains.type.astype(np.int32)
    box = None if grains.box is None else axes.box(grains.box)
    file.frame(step, float(found.times[k]), dt, box, grains.ids, wall, vectors, scalars)
    moving = ~wall
    way = place if grains.way is None else axes.places(grains.way)
    spin = vectors.get("angular_velocity")
    ledger.add(
        float(found.times[k]),
        grains.ids[moving],
        mass[moving],
        grains.radius[moving],
        way[moving],
        vectors["velocity"][moving],
        None if spin is None else spin[moving],
    )


def turned(contacts: Contacts, axes: Axes) -> Contacts:
    """The same in our axes."""
    return Contacts(
        contacts.first,
        contacts.second,
        axes.vectors(contacts.branch),
        axes.places(contacts.point),
        axes.vectors(contacts.force),
        contacts.power,
    )


def pull(found: Scene, notes: list[str]) -> np.ndarray:
    """Gravity (3,) as far as places tell its work: through a periodic face they do so only with
    image flags.
    """
    first = found.series[0]
    if first.box is None or first.way is not None:
        return found.gravity
    lost = found.axes.box(first.box).periodic & (np.abs(found.gravity) > 1e-9)
    if lost.any():
        notes.append(
            "absent: the work of gravity along periodic axes (image flags ix iy iz would tell it)"
        )
    return np.where(lost, 0.0, found.gravity)


def in_file_axes(found: Scene) -> np.ndarray:
    """Places (3, 2) of the plane walls in the file's axes [m], NaN where there is none."""
    out = np.full((3, 2), np.nan)
    for k, row in enumerate(found.axes.turn):
        axis, sign = int(np.argmax(np.abs(row))), row.sum()
        for side, wall in enumerate((found.low[k], found.high[k])):
            face = side if sign > 0.0 else 1 - side
            out[axis, face] = found.axes.origin[axis] + sign * wall
    return out


def step_of(found: Scene) -> float:
    """Time of one step [s], NaN where it is not told."""
    instants = found.series.instants
    if len(instants) < 2 or instants[0].pieces[0].step is None:
        return float("nan")
    return float((found.times[-1] - found.times[0]) / (instants[-1].step - instants[0].step))


def tell(
    ledger: Ledger,
    rows: dict[str, np.ndarray],
    dense: float,
    deep: float,
    found: Scene,
    notes: list[str],
):
    """Notes on what no grains do."""
    if ledger.vanished:
        notes.append(
            f"vanished: {ledger.vanished} of {found.sizes.count} grains are gone from later "
            f"frames, {rows['lost'][-1]:.3g} J with them (account lost)"
        )
    if ledger.came:
        notes.append(f"came: {ledger.came} grains are in later frames only")
    if dense > plausible.DENSEST:
        notes.append(
            f"implausible: a solid fraction of {dense:.2f} (of equal spheres 0.74 at most) are the "
            "radii right?"
        )
    if deep > plausible.DEEPEST:
        notes.append(f"implausible: two grains overlap by {100 * deep:.0f} % of a diameter")
    potential = rows["potential"]
    released = potential[0] - potential[-1] - rows["lost_potential"][-1]
    if len(potential) > 1 and released < -1e-6 * np.abs(potential).max():
        notes.append(
            f"implausible: the grains gain {-released:.3g} J of potential energy (is up right?)"
        )
