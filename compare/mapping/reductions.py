"""What several metrics and charts share: quantiles, heights, matching instants; and runs made of
arrays for examples.
"""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from cases.case import parse
from compare.mapping.clouds import Cloud
from compare.mapping.runs import Fields, Grid, Run

EXAMPLE_COSTS = {
    "cpu_seconds": 1.0,
    "cpu_seconds_engine": 0.5,
    "cpu_seconds_audit": 0.25,
    "cpu_seconds_output": 0.125,
    "cpu_seconds_setup": 0.0625,
}
DENSE = "fluctuation_dense"  # what a signature calls dense_fluctuation


def mass_quantile(x: np.ndarray, mass: np.ndarray, q: float) -> float:
    """The x that the share q of the mass lies within: the x of the first point at which the sum of
    mass reaches it.

    Where the share is a whole number of equal masses, round-off of the sum must not decide: 1e-9 of
    the mass is more than the sum of millions loses, and less than one of them.
    """
    order = np.argsort(x, kind="stable")
    sums = np.cumsum(mass[order])
    return float(
        x[order][np.searchsorted(sums, (q - 1e-9) * sums[-1], side="left").clip(0, len(x) - 1)]
    )


def bulk_solid_fraction(run: Run) -> float:
    """1/(1 + e0) of the case: one reference for both engines."""
    return 1.0 / (1.0 + run.case["initial.void_ratio"])


def surface(run: Run, frame: int, share: float = 0.5) -> np.ndarray:
    """Height (nx,) [m] up to which the solid fraction, followed from the floor, exceeds `share` of
    the bulk's.
    """
    grid, phi = run.fields.grid, run.fields["solid_fraction"][frame]
    limit = share * bulk_solid_fraction(run)
    below = phi < limit
    first = np.where(below.any(axis=0), below.argmax(axis=0), len(grid.y))
    heights = np.zeros(len(grid.x))
    for i, k in enumerate(first):
        if k == len(grid.y):
            heights[i] = grid.y[-1] + 0.5 * grid.spacing
        elif k > 0:
            above, under = phi[k, i], phi[k - 1, i]
            heights[i] = grid.y[k - 1] + (under - limit) / (under - above) * (
                grid.y[k] - grid.y[k - 1]
            )
    return heights


def equivalent_height(run: Run, frame: int) -> np.ndarray:
    """Height (nx,) [m] that the solid above each x would have at the bulk's solid fraction."""
    grid = run.fields.grid
    return run.fields["solid_fraction"][frame].sum(axis=0) * grid.spacing / bulk_solid_fraction(run)


def last_above(x: np.ndarray, h: np.ndarray, limit: float) -> float:
    """The largest x at which the piecewise linear h falls through `limit`; 0 when h is nowhere
    above.
    """
    above = np.flatnonzero(h >= limit)
    if not len(above):
        return 0.0
    k = above[-1]
    if k == len(x) - 1:
        return float(x[-1])
    return float(x[k] + (h[k] - limit) / (h[k] - h[k + 1]) * (x[k + 1] - x[k]))


def main_mass(run: Run, frame: int) -> np.ndarray:
    """Cells (ny, nx) of the heaviest connected region whose solid fraction exceeds a twentieth of
    the bulk's.
    """
    phi = run.fields["solid_fraction"][frame]
    inside = phi > 0.05 * bulk_solid_fraction(run)
    labels = regions(inside)
    if not inside.any():
        return inside
    mass = (phi * run.fields.grid.cell_volume)[inside]
    return labels == np.argmax(np.bincount(labels[inside], mass))


def regions(inside: np.ndarray) -> np.ndarray:
    """A number for each connected region of the cells (ny, nx) that are `inside`, those that meet
    at a corner included: that of its last cell; -1 for all others.
    """
    labels = np.where(inside, np.arange(inside.size).reshape(inside.shape), -1)
    while True:
        around = sliding_window_view(np.pad(labels, 1, constant_values=-1), (3, 3))
        grown = np.where(inside, around.max(axis=(2, 3)), -1)
        grown[inside] = grown.ravel()[grown[inside]]  # and at once what that cell has seen
        if np.array_equal(grown, labels):
            return labels
        labels = grown


def integral(values: np.ndarray, at: np.ndarray) -> float:
    """By the trapezoidal rule, whose name in NumPy 1 is none in NumPy 2, and the reverse."""
    return float(np.sum(np.diff(at) * (values[1:] + values[:-1]) / 2.0))


def wasserstein(x: np.ndarray, y: np.ndarray, mass_x: np.ndarray, mass_y: np.ndarray) -> float:
    """Distance of two distributions of mass along a line: the integral of |F_x - F_y|, where F is
    the share of the mass up to there.
    """
    places = np.sort(np.concatenate([x, y]))

    def share(of: np.ndarray, mass: np.ndarray) -> np.ndarray:
        order = np.argsort(of, kind="stable")
        total = np.concatenate([[0.0], np.cumsum(mass[order])])
        return total[np.searchsorted(of[order], places[:-1], side="right")] / total[-1]

    apart = np.abs(share(x, mass_x) - share(y, mass_y))
    return float(np.sum(apart * np.diff(places)))


def crossing_time(t: np.ndarray, values: np.ndarray, target: float) -> float:
    """First time the piecewise linear series reaches the target from below; NaN when it
    never does, or is one instant.
    """
    if len(t) < 2:
        return float("nan")
    reached = np.flatnonzero(values >= target)
    if not len(reached):
        return float("nan")
    k = reached[0]
    if k == 0:
        return float(t[0])
    return float(
        t[k - 1] + (target - values[k - 1]) / (values[k] - values[k - 1]) * (t[k] - t[k - 1])
    )


def front(run: Run, share: float = 0.995) -> np.ndarray:
    """The x within which the share of the mass lies, at every frame [m]."""
    return np.array([mass_quantile(cloud.x[:, 0], cloud.mass, share) for cloud in run.clouds])


def first_entries(run: Run) -> np.ndarray:
    """(4, N): time [sqrt(H/g)] of the first frame at which each point is in regime 1, 2, 3, 4;
    infinite when it never is.
    """
    regimes = np.array([cloud.state["regime"] for cloud in run.clouds])
    found = [regimes == k for k in (1, 2, 3, 4)]
    return np.array(
        [np.where(at.any(axis=0), run.tau()[at.argmax(axis=0)], np.inf) for at in found]
    )


def common_frames(a: Run, b: Run) -> list[tuple[int, int]]:
    """Pairs of frames that show the same instant, to half of a's frame interval (a step count
    rarely divides it).
    """
    ta, tb = a.tau(), b.tau()
    tolerance = 0.5 * (np.median(np.diff(ta)) if len(ta) > 1 else 1.0)
    nearest = [int(np.argmin(abs(tb - t))) for t in ta]
    return [(i, k) for i, k in enumerate(nearest) if abs(tb[k] - ta[i]) <= tolerance]


def dense_in_both(mpm: Run, dem: Run, i: int, k: int) -> np.ndarray:
    """Cells (ny, nx) where both engines have more than half the bulk's solid fraction."""
    limit = 0.5 * bulk_solid_fraction(dem)
    return (mpm.fields["solid_fraction"][i] > limit) & (dem.fields["solid_fraction"][k] > limit)


def temperature(run: Run, frame: int) -> np.ndarray:
    """Granular temperature (ny, nx) [m2/s2]: the material points' own, or the grains' measured one;
    NaN where imported points do not tell theirs.
    """
    own = "granular_temperature_state"
    if own not in run.fields and run.imported and run.engine == "mpm":
        return np.full_like(run.fields["density"][frame], np.nan)
    return run.fields[own if own in run.fields else "granular_temperature"][frame]


def dense_fluctuation(run: Run) -> tuple[np.ndarray, np.ndarray] | None:
    """Times [sqrt(H/g)] and, at each, the energy of fluctuations in what is dense [J]: the integral
    of 3/2 rho T, T as `temperature` gives it, over the cells with more than half of the bulk's
    solid fraction. None where no fields, and no signature, tell it.
    """
    if DENSE in run.energy:
        return run.energy_tau(), run.energy[DENSE]
    if run.mapped is None or "granular_temperature" not in run.fields:
        return None
    limit, volume = 0.5 * bulk_solid_fraction(run), run.fields.grid.cell_volume
    held = [
        1.5 * np.nansum((volume * rho * temperature(run, frame))[phi > limit])
        for frame, (rho, phi) in enumerate(zip(run.fields["density"], run.fields["solid_fraction"]))
    ]
    return run.fields.time / run.time_scale, np.array(held)


def has_temperature(run: Run) -> bool:
    """Whether a run knows a granular temperature: grains do, and some laws of the continuum."""
    own = "granular_temperature_state"
    held = run.energy.get("fluctuation", np.zeros(1))
    if np.any(held) or run.mapped is None:
        return bool(np.any(held))
    return own in run.fields and bool(np.nanmax(run.fields[own]) > 0.0)


def stress(run: Run, frame: int) -> np.ndarray:
    """Stress (ny, nx, 3, 3) [Pa]: the material points' own, or the grains' contact and kinetic
    stress; NaN without contacts.
    """
    if "stress_state" in run.fields:
        return run.fields["stress_state"][frame]
    kinetic = run.fields["kinetic_stress"][frame]
    return (
        kinetic + run.fields["contact_stress"][frame]
        if "contact_stress" in run.fields
        else np.full_like(kinetic, np.nan)
    )


def masked_error(mpm: Run, dem: Run, field) -> float:
    """Root of sum rho |a - b|^2 over sum rho |b|^2, a = field(mpm, frame) and b = field(dem, frame)
    of shape (ny, nx, ...).

    rho is the grains' density; over all common instants and the cells where both engines have more
    than half of the bulk's solid fraction and both values are defined. NaN where no such cell is
    left or b vanishes.
    """
    difference = reference = 0.0
    for i, k in common_frames(mpm, dem):
        mask = dense_in_both(mpm, dem, i, k)
        if not mask.any():
            continue
        a, b = (
            field(run, frame)[mask].reshape(mask.sum(), -1) for run, frame in ((mpm, i), (dem, k))
        )
        rho, known = dem.fields["density"][k][mask], np.isfinite(a + b).all(axis=1)
        difference += float(np.sum(rho[known] * ((a - b)[known] ** 2).sum(axis=1)))
        reference += float(np.sum(rho[known] * (b[known] ** 2).sum(axis=1)))
    return float(np.sqrt(difference / reference)) if reference > 0.0 else float("nan")


def lines_of(silo: dict | None) -> str:
    """What a case says of a silo, after the lines of [geometry]; nothing where there is none."""
    if silo is None:
        return ""
    lines = [f"{key} = {value}" for key, value in silo.items()]
    return "\n".join([*lines, 'scene = "silo"', "[walls]", 'base = "coulomb"', ""])


def example_run(
    *,
    x=None,
    v=None,
    time=(0.0,),
    energy=None,
    solid_fraction=None,
    spacing=1.0,
    engine="dem",
    diameter=0.1,
    state=None,
    silo=None,
    **fields,
):
    """A run made of arrays, for examples of metrics and statements: H = L0 = g = 1, e0 = 1, points
    of mass 1.

    x: (frames, N, 3); state: records by name, (frames, N); silo: orifice and fall [m] of one;
    solid_fraction and other fields: (frames, ny, nx, ...) on a grid of `spacing`.
    """
    case = parse(
        "[geometry]\nheight = 1.0\nlength = 1.0\ngravity = 1.0\nthickness = 1.0\n"
        f"floor_length = 100.0\n{lines_of(silo)}"
        f"[grains]\ndiameter = {diameter}\ndensity = 1.0\n[initial]\nvoid_ratio = 1.0\n"
        "[mpm]\ncell_size = 0.05\n[compare]\nmargin_run_out = 0.05\nmargin_height = 0.05\n"
        "margin_time = 0.05\nmargin_energy = 0.05\nmargin_distance = 0.03\n"
    )
    x = np.zeros((len(time), 1, 3)) if x is None else np.asarray(x, dtype=float)
    v = np.zeros_like(x) if v is None else np.asarray(v, dtype=float)
    ones = np.ones(x.shape[1])
    known = {name: np.asarray(values, dtype=float) for name, values in (state or {}).items()}
    clouds = [
        Cloud(xs, vs, ones, ones, {name: values[i] for name, values in known.items()})
        for i, (xs, vs) in enumerate(zip(x, v))
    ]
    mapped = None
    if solid_fraction is not None:
        phi = np.asarray(solid_fraction, dtype=float)
        grid = Grid(
            (np.arange(phi.shape[2]) + 0.5) * spacing,
            (np.arange(phi.shape[1]) + 0.5) * spacing,
            spacing**2,
        )
        values = {"solid_fraction": phi, "density": phi} | {
            k: np.asarray(f, dtype=float) for k, f in fields.items()
        }
        mapped = Fields(grid, np.asarray(time), values)
    history = {
        k: np.asarray(values, dtype=float) for k, values in (energy or {"time": [0.0]}).items()
    }
    return Run(
        "example",
        engine,
        case,
        np.asarray(time, dtype=float),
        clouds,
        history,
        dict(EXAMPLE_COSTS),
        mapped,
    )
