"""What is measured of one side of a chute, from its profiles over y averaged over time.

Places are measured from the top of the base, y = 0, where the highest glued grains end. The depth
is that of a layer of the core's solid fraction, mass/(area rho_s nu); the core lies between a
quarter and three quarters of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan, degrees, inf, isfinite, nan, tan

import numpy as np

from compare.maps.profiles import Profile, momentum_flux

CORE = (0.25, 0.75)  # of the depth
# The flow is steady if the mean velocity of the two halves of what is averaged differs by less than
# this share of the larger. Halves of a steady flow of the case's size differ by 1 to 2 %.
STEADY = 0.04
STOPPED = 1e-3  # mean velocity below which a layer is at rest [sqrt(g H)]
# Points may be nearer than their own void ratios tell by this mean share: of rows in order it is
# below 1 %, of points that have left theirs 10 % and more.
CROWDED = 0.05
LEAST = 1e-12


@dataclass(frozen=True)
class Flow:
    """Figures of one side, and what they are made of.

    y (n,) [m] and columns over it: place [m], solid_fraction, velocity [m/s], shear_rate [1/s],
    temperature [m2/s2], normal, shear [Pa], weight and drive: what lies above weighs and is pulled
    by [Pa]; crowding: by how much more solid is there than the points' own void ratios tell.
    """

    name: str
    y: np.ndarray
    columns: dict[str, np.ndarray]
    core: np.ndarray  # (n,) which places are the core
    bulk: np.ndarray  # (n,) which lie a kernel's reach or more inside the layer
    state: str  # "steady", "stopped", "speeds up", "slows down"; "crowded": spoilt by the numerics
    figures: dict[str, float]


def measure(
    name: str,
    profile: Profile,
    halves: tuple[float, float],
    gravity: tuple[float, float],
    scale: dict[str, float],
) -> Flow:
    """Of a profile that is open at walls, averaged over a span of time.

    halves: mean velocity of the first and second half of that span [m/s]; gravity along x and -y
    [m/s2]; scale: diameter [m], density of the grains [kg/m3], height of the layer [m], area of the
    base [m2], mass [kg].
    """
    d, solid = scale["diameter"], scale["density"]
    y, rho, nu = profile.place, profile["density"], profile["solid_fraction"]
    flux = momentum_flux(profile)
    if flux is None:
        flux = np.full((len(y), 3, 3), nan)
    step = y[1] - y[0]
    velocity = profile["velocity"][:, 0]
    temperature = first_of(profile, "granular_temperature_state", "granular_temperature")
    if not (temperature > LEAST).any():  # of a law without one
        temperature = np.full(len(y), nan)
    above = (np.cumsum(rho[::-1])[::-1] - 0.5 * rho) * step  # [kg/m2]
    columns = {
        "place": y,
        "solid_fraction": nu,
        "velocity": velocity,
        "shear_rate": np.gradient(velocity, y),
        "temperature": temperature,
        "normal": flux[:, 1, 1],
        "shear": -flux[:, 0, 1],  # compression is positive: what lies below holds back
        "crowding": nu * (1.0 + first_of(profile, "void_ratio_state")) - 1.0,
        "weight": above * gravity[1],
        "drive": above * gravity[0],
    }
    depth = depth_of(y, nu, scale["mass"] / (scale["area"] * solid))
    core = (y > CORE[0] * depth) & (y < CORE[1] * depth)
    occupied = np.flatnonzero(rho > 0.05 * rho.max())
    top = y[occupied[-1]]
    bulk = (y > profile.cutoff) & (y < top - profile.cutoff)
    figures = figures_of(columns, core, bulk, depth, halves, gravity, d, solid)
    state = state_of(halves, (gravity[0] ** 2 + gravity[1] ** 2) ** 0.25 * scale["height"] ** 0.5)
    return Flow(
        name,
        y,
        columns,
        core,
        bulk,
        "crowded" if figures["crowding"] > CROWDED else state,
        figures | {"mean_velocity": float(profile["momentum"][:, 0].sum() / rho.sum())},
    )


def first_of(profile: Profile, *names: str) -> np.ndarray:
    """The first field of these that a profile has and that holds something; NaN where none does."""
    for name in names:
        if name in profile:
            return profile[name]
    return np.full(len(profile.place), nan)


def depth_of(y: np.ndarray, nu: np.ndarray, solid: float) -> float:
    """Depth of a layer of `solid` [m3/m2] as dense as its core [m]; NaN where nothing is, as of a
    layer that was thrown apart.
    """
    depth = solid / float(np.median(nu[nu > 0.5 * nu.max()]))
    for _ in range(20):
        core = (y > CORE[0] * depth) & (y < CORE[1] * depth) & (nu > 0.0)
        if not nu[core].sum() > 0.0:
            return nan
        depth = solid / float(nu[core].mean())
    return depth


def state_of(halves: tuple[float, float], fall: float) -> str:
    early, late = halves
    if max(abs(early), abs(late)) < STOPPED * fall:
        return "stopped"
    change = (late - early) / max(abs(early), abs(late))
    if abs(change) < STEADY:
        return "steady"
    return "speeds up" if change > 0.0 else "slows down"


def figures_of(columns, core, bulk, depth, halves, gravity, d, solid) -> dict[str, float]:
    """Of the columns; NaN where a flow that stands has none."""

    def mean(values: np.ndarray) -> float:
        found = values[core & np.isfinite(values)]
        return float(found.mean()) if len(found) else nan

    rate = columns["shear_rate"]
    flows = np.where(abs(rate) > LEAST, rate, nan)
    ratio = columns["shear"] / np.where(columns["normal"] > LEAST, columns["normal"], nan)
    pressure = np.maximum(columns["normal"], LEAST)
    weight, drive = (float(columns[name].max()) for name in ("weight", "drive"))
    off_normal = abs(columns["normal"] - columns["weight"])[bulk] / max(weight, LEAST)
    off_shear = abs(columns["shear"] - columns["drive"])[bulk] / (drive or inf)
    late = max(abs(halves[0]), abs(halves[1]), LEAST)
    return {
        "depth": depth / d,
        "solid_fraction": mean(columns["solid_fraction"]),
        "solid_fraction_scatter": float(np.std(columns["solid_fraction"][core]))
        if core.any()
        else nan,
        "temperature_ratio": mean(columns["temperature"] / (flows * d) ** 2),
        "inertial_number": mean(rate * d / np.sqrt(pressure / solid)),
        "stress_ratio": mean(ratio),
        "friction_angle": degrees(atan(mean(ratio))) if isfinite(mean(ratio)) else nan,
        "tangent": gravity[0] / gravity[1],
        "normal_balance": float(off_normal.max()) if bulk.any() else nan,
        "shear_balance": float(off_shear.max()) if bulk.any() and drive else nan,
        "bagnold": bagnold(columns, depth, d, gravity),
        "change": (halves[1] - halves[0]) / late,
        "crowding": crowding(columns["crowding"], columns["solid_fraction"]),
    }


def crowding(off: np.ndarray, nu: np.ndarray) -> float:
    """By how much points are nearer than their own void ratios tell, a mean over the solid; NaN of
    grains. Where they are farther apart there is a surface.
    """
    known = np.isfinite(off)
    if not known.any():
        return nan
    return float((nu[known] * np.maximum(off[known], 0.0)).sum() / nu[known].sum())


def bagnold(columns: dict, depth: float, d: float, gravity: tuple[float, float]) -> float:
    """Exponent n of v = v_0 + c (1 - (1 - y/h)^n) fitted over the core and its neighbourhood, 10 to
    90 % of the depth; 3/2 where the inertial number is the same at every depth. NaN at rest.
    """
    y = columns["place"]
    inside = (y > 0.1 * depth) & (y < 0.9 * depth)
    v = columns["velocity"][inside]
    if inside.sum() < 5 or np.ptp(v) < 1e-6 * (gravity[1] * depth) ** 0.5:
        return nan
    share = 1.0 - y[inside] / depth

    def misfit(n: float) -> float:
        basis = np.column_stack([np.ones(len(v)), 1.0 - share**n])
        found = np.linalg.lstsq(basis, v, rcond=None)[0]
        return float(((basis @ found - v) ** 2).sum())

    exponents = np.linspace(0.5, 4.0, 351)
    return float(exponents[int(np.argmin([misfit(n) for n in exponents]))])


def power(depths: Sequence[float], velocities: Sequence[float]) -> float:
    """Exponent of the mean velocity over the depth, by least squares of the logarithms."""
    x, y = np.log(np.asarray(depths)), np.log(np.asarray(velocities))
    return float(np.polyfit(x, y, 1)[0])


def inertial_number(inclination: float, static: float, dynamic: float, reference: float) -> float:
    """Of mu(I) = static + (dynamic - static)/(1 + I0/I) at the tangent of an angle [deg]; inf above
    what the law can hold, 0 below what it needs to flow.
    """
    mu = tan(np.radians(inclination))
    if mu <= static:
        return 0.0
    return inf if mu >= dynamic else reference * (mu - static) / (dynamic - mu)
