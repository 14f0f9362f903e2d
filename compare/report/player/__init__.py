"""Both sides of a comparison in time, inside its report: continuum points and grains, played.

`build` makes of a comparison what player.html.j2 shows: the particles, packed by `packing`, and a
picture of three instants, which stands there on paper and where no WebGL is. The browser draws with
three.js of Debian (libjs-three), which each report carries, deflated, so that it opens from a file
with no network. Only what is here is our own: the packing and its way back, how a particle is
coloured, and the controls.
"""

import base64
import json
import zlib
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from markupsafe import Markup

from compare.mapping.runs import Run
from compare.report.player import still
from compare.report.player.packing import (
    BUDGET,
    Channel,
    allowances,
    depths,
    encode,
    place_error,
    places,
)
from compare.report.player.quantities import Quantity, quantities
from compare.report.player.tracks import MAPPED, SIDES, Track, read, size_of
from compare.verdict.comparison import Comparison

FOLDER = Path(__file__).parent
THREE = Path("/usr/share/javascript/three/three.min.js")
SCRIPTS = ("drawing.js", "player.js")
SEEN = 0.995  # share of each side's particles that the picture is wide enough for, at any time
SAMPLES = 400  # of an energy curve, the most
ENERGIES = (
    ("kinetic", "Kinetic energy of the mean motion"),
    ("potential", "Potential energy left"),
    ("dissipated", "Energy dissipated"),
)


@dataclass(frozen=True)
class Player:
    """What the template shows; `missing` says why there is nothing to play, else it is empty."""

    missing: str = ""
    style: Markup = Markup()
    script: Markup = Markup()
    data: Markup = Markup()  # JSON
    three: str = ""  # three.js, deflated, in base64
    still: str = ""  # data URI
    alt: str = ""
    notes: tuple[str, ...] = ()
    quantities: tuple[Quantity, ...] = ()
    unknown: tuple[str, ...] = ()  # quantities that neither side knows
    energies: tuple[tuple[str, str], ...] = ()
    aspect: float = 1.0  # width over height of what is seen of a side


def build(c: Comparison, budget: int = BUDGET) -> Player:
    """The player of the first run of either engine, whose particles take `budget` bytes of the page
    at most. Raises CaseError where a frame cannot be read.

    A comparison without two instants on each side, or on a machine without three.js, has none, and
    the page says so.
    """
    runs = list(c.first)
    for run in runs:
        if len(run.time) < 2 or not np.all(np.isfinite(run.time)):
            return Player(missing=f"{run.name}.h5 holds no two instants whose times are told")
    if not THREE.is_file():
        return Player(missing=f"{THREE} was not there when this page was made (libjs-three)")
    sizes = [int(np.prod(size_of(run))) for run in runs]
    tracks = [read(run, allowed) for run, allowed in zip(runs, allowances(sizes, budget))]
    known = quantities(runs[1], tracks)
    box, view = bounds(tracks, runs[0])
    scale = runs[0].time_scale
    peak = float(runs[1].energy["time"][np.argmax(runs[1].joules("kinetic"))])
    energies = [energy(run) for run in runs]
    told = {
        "scale": scale,
        "length": runs[0].length,
        "height": runs[0].height,
        "start": min(peak, min(float(track.time[-1]) for track in tracks)),
        "box": box,
        "view": view,
        "quantities": [quantity.told() for quantity in known],
        "sides": [
            side(track, known, box) | {"energy": held} for track, held in zip(tracks, energies)
        ],
    }
    times = still.instants(tracks, peak)
    return Player(
        style=Markup((FOLDER / "player.css").read_text()),
        script=Markup("".join((FOLDER / name).read_text() for name in SCRIPTS)),
        # no "</script>" may stand in a script, nor a number that JSON has no word for
        data=Markup(json.dumps(told, allow_nan=False).replace("<", "\\u003c")),
        three=base64.b64encode(zlib.compress(THREE.read_bytes(), 9)).decode(),
        still=still.picture(tracks, known[0], times, view, scale),
        alt=alternative(times, scale, known[0]),
        notes=tuple(notes(tracks, runs, box, view)),
        quantities=tuple(known),
        unknown=tuple(q.name for q in known if all(q.codes(t) is None for t in tracks)),
        energies=ENERGIES if all(energies) else (),
        aspect=(view[1] - view[0]) / (view[3] - view[2]),
    )


def bounds(
    tracks: list[Track], run: Run
) -> tuple[list[list[float]], tuple[float, float, float, float]]:
    """The box [[low, high], …] along x, y, z that holds all places at all times, and what is seen
    of it, x from, x to, y from, y to: the column at least, and SEEN of the particles [m].
    """
    low = np.min([np.nanmin(t.x, axis=(0, 1)) for t in tracks], axis=0)
    high = np.max([np.nanmax(t.x, axis=(0, 1)) for t in tracks], axis=0)
    largest = max(float(np.nanmax(t.size)) for t in tracks)
    far = max(float(np.nanquantile(t.x[:, :, 0], SEEN, axis=1).max()) for t in tracks)
    top = max(run.height, max(float(np.nanquantile(t.x[0, :, 1], 1.0)) for t in tracks))
    far, margin = max(far, run.length) + 3.0 * largest, 2.0 * largest
    box = [[float(a), float(b)] for a, b in zip(low, high)]
    return box, (-margin, min(far, box[0][1] + margin), -margin, 1.03 * top + margin)


def side(track: Track, known: list[Quantity], box: list[list[float]]) -> dict:
    """One side as the page holds it: its times and channels, by name."""
    (x0, x1), (y0, y1), (z0, z1) = box
    name, one = SIDES[track.engine]
    largest = float(track.size.max())
    codes = {
        "x": places(track.x[:, :, 0], x0, x1),
        "y": places(track.x[:, :, 1], y0, y1),
        "z": depths(track.x[:, :, 2], z0, z1),
        "size": places(track.size[None, :], 0.0, largest),
        "surface": places(track.surface, 0.0, top := float(track.surface.max())),
    }
    codes |= {q.name: found for q in known if (found := q.codes(track)) is not None}
    return {
        "name": name,
        "one": one,
        "engine": track.engine,
        "time": [float(f"{t:.7g}") for t in track.time],
        "largest": largest,
        "top": top,
        "columns": [float(track.columns[0]), float(track.columns[1] - track.columns[0])],
        "smooth": track.followed,
        "mapped": MAPPED if track.engine == "dem" else (),
        "unknown": track.unknown | ({} if track.ids is not None else {"id": "the file has none"}),
        "channels": {name: asdict(packed(array)) for name, array in codes.items()},
    }


def packed(codes: np.ndarray) -> Channel:
    return encode(np.ascontiguousarray(codes))


def energy(run: Run) -> dict | None:
    """Times [s] and energies over E0 of a run, at SAMPLES samples at most; None where nobody knows
    E0 or an account.
    """
    kept = np.unique(np.linspace(0, len(run.energy["time"]) - 1, SAMPLES).astype(int))
    potential = run.normalised("potential")
    curves = {
        "time": run.energy["time"],
        "kinetic": run.mean_motion(),
        "potential": potential - potential[-1],
        "dissipated": run.normalised("dissipated"),
    }
    if not all(np.isfinite(values).all() for values in curves.values()):
        return None
    return {name: [float(f"{v:.5g}") for v in values[kept]] for name, values in curves.items()}


def notes(tracks: list[Track], runs: list[Run], box, view) -> list[str]:
    """What a reader must know of the picture: what is left out, rounded, interpolated, not seen."""
    out = []
    for track, run in zip(tracks, runs):
        one = SIDES[track.engine][1]
        if track.kept[0] > 1:
            out.append(f"Of the {one}s' {len(run.time)} frames one in {track.kept[0]} is here.")
        if track.kept[1] > 1:
            larger = ", drawn so much larger that they cover the same area"
            out.append(
                f"One {one} in {track.kept[1]} is shown, drawn at random once"
                f"{larger if track.engine == 'mpm' else ''}."
            )
        if not track.followed:
            out.append(f"The {one}s' file has no ids: their frames are shown as they are.")
        gone = int(np.sum(track.x[-1, :, 0] > view[1]))
        if gone:
            ends = f"s of {track.x.shape[1]} end" if gone > 1 else f" of {track.x.shape[1]} ends"
            out.append(f"{gone} {one}{ends} to the right of the picture.")
    error = 1e6 * max(place_error(low, high) for low, high in box[:2])
    out.append(
        f"Places are rounded to {error:.2g} µm, values to 1/254 of their range; between two frames "
        "they are interpolated."
    )
    return out


def alternative(times: list[float], scale: float, quantity: Quantity) -> str:
    """What is seen in the picture, in words."""
    when = ", ".join(f"{t / scale:.1f}" for t in times)
    return (
        f"Continuum points on the left and grains on the right at t = {when} √(H/g), "
        f"seen from the side and coloured by {quantity.label}, with their free surfaces."
    )
