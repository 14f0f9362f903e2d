"""Profiles along one axis, their momentum balance, and what the kernel's width does to them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from cases.reading import attributes, opened
from compare.mapping.runs import map_fields
from compare.maps.source import AXES, Source

TEMPERATURES = (
    "granular_temperature",
    "granular_temperature_per_grain",
    "granular_temperature_two_step",
    "granular_temperature_one_step",
)
SCALARS = (
    "solid_fraction",
    "density",
    *TEMPERATURES,
    "rotational_temperature",
    "granular_temperature_state",
    "pressure",
    "deviatoric_stress",
    "stress_ratio",
    "inertial_number",
    "shear_rate",
    "coordination",
)
STRESSES = ("contact_stress", "kinetic_stress", "mean_fluctuation_stress", "stress_state")
WIDTHS = (0.25, 0.35, 0.5, 0.6, 0.75, 0.9, 1.0, 1.25, 1.5, 2.0)  # [d]
FLAT = 0.03  # what a field may change by on a plateau


@dataclass(frozen=True)
class Profile:
    """Fields along an axis: `place` (n,) [m], each of `fields` (n,), (n, 3) or (n, 3, 3)."""

    place: np.ndarray
    fields: dict[str, np.ndarray]
    cutoff: float
    diameter: float
    folded: tuple[bool, bool]  # whether the ends are walls that kernels are folded at

    def __contains__(self, name: str) -> bool:
        return name in self.fields

    def __getitem__(self, name: str) -> np.ndarray:
        return self.fields[name]


def mapped(sources: list[Source], path: Path, along: str, *words) -> dict[str, list[Profile]]:
    """The profiles of every frame of every source, mapped into the file `path`."""
    files = [source.path for source in sources]
    map_fields(files, path, "--dimension", "1", "--along", along, *words)
    return {source.name: read(path, source.name, along) for source in sources}


def read(path: Path, name: str, along: str) -> list[Profile]:
    with opened(path) as f:
        axis = f[f"grid/{along}"]
        edges = attributes(axis)
        folded = tuple(edges[f"{end}_edge"] == "mirror" for end in ("low", "high"))
        values = {field: data[:] for field, data in f[name].items() if "doc" in data.attrs}
        frames = len(f[name]["density"])
        places = [axis[:]] * frames
        if "box_lower" in f[name] and edges["low_edge"] == "periodic":
            i, shares = AXES.index(along), (np.arange(len(axis)) + 0.5) / len(axis)
            low, high = f[name]["box_lower"][:, i], f[name]["box_upper"][:, i]
            places = [a + shares * (b - a) for a, b in zip(low, high)]
        return [
            Profile(
                place,
                {field: data[k] for field, data in values.items()},
                float(f.attrs["cutoff"]),
                float(f[name].attrs["diameter"]),
                (bool(folded[0]), bool(folded[1])),
            )
            for k, place in zip(range(frames), places)
        ]


def table(profiles: dict[str, list[Profile]], labels: dict[str, list[str]], along: str):
    """One row per place, frame and source; vectors and tensors by components."""
    rows = []
    for name, frames in profiles.items():
        for label, profile in zip(labels[name], frames):
            columns = {along: profile.place} | {
                field: profile[field] for field in SCALARS if field in profile
            }
            for i, a in enumerate(AXES):
                columns[f"velocity_{a}"] = profile["velocity"][:, i]
            for stress in (one for one in STRESSES if one in profile):
                for i, a in enumerate(AXES):
                    for j, b in enumerate(AXES):
                        columns[f"{stress}_{a}{b}"] = profile[stress][:, i, j]
            frame = pd.DataFrame(columns)
            frame.insert(0, "frame", label)
            frame.insert(0, "source", name)
            rows.append(frame[frame["density"] > 0.0])
    return pd.concat(rows, ignore_index=True)


def momentum_flux(profile: Profile) -> np.ndarray | None:
    """(n, 3, 3) [Pa]: all stresses and rho V V; None where the file has no stress."""
    if "stress_state" in profile:
        stress = profile["stress_state"]
    elif "contact_stress" in profile:
        stress = profile["contact_stress"] + profile["kinetic_stress"]
        if "mean_fluctuation_stress" in profile:
            stress = stress + profile["mean_fluctuation_stress"]
    else:
        return None
    rho = profile["density"]
    velocity = np.divide(
        profile["momentum"], rho[:, None], out=np.zeros((len(rho), 3)), where=rho[:, None] > 0.0
    )
    return stress + rho[:, None, None] * velocity[:, :, None] * velocity[:, None, :]


@dataclass(frozen=True)
class Balance:
    """-d(sigma + rho V V)/ds + t + rho g along an axis: `residual` (n, 3) [N/m3], over `scale`, the
    largest rho |g|, in the `bulk` (n,), which lies a kernel's reach or more inside the grains.

    `carried` (n,) [Pa]: what lies above each place weighs, less what walls there carry; `stress`
    the normal component of the momentum flux. `unexplained`: the sum of the residual's normal
    component over the weight: the share of the weight that no force of the file holds.
    """

    place: np.ndarray
    residual: np.ndarray
    scale: float
    bulk: np.ndarray
    stress: np.ndarray
    carried: np.ndarray
    unexplained: float

    @property
    def closing(self) -> np.ndarray:
        """Root mean square (3,) of the residual in the bulk, over the scale."""
        if not self.bulk.any():
            return np.full(3, np.nan)
        return np.sqrt(np.mean(self.residual[self.bulk] ** 2, axis=0)) / self.scale

    @property
    def carrying(self) -> float:
        """Largest deviation of the stress from what it carries in the bulk, over the largest of
        that.
        """
        if not self.bulk.any():
            return float("nan")
        off = abs(self.stress - self.carried)[self.bulk]
        return float(off.max() / abs(self.carried).max())


def balance(profile: Profile, gravity: np.ndarray, along: str) -> Balance | None:
    """None where there is no stress, or no gravity is told. The profile must be open at walls."""
    flux, a = momentum_flux(profile), AXES.index(along)
    if flux is None or not np.isfinite(gravity).all() or not gravity.any():
        return None
    place, rho = profile.place, profile["density"]
    force = rho[:, None] * gravity
    if "interaction_force_density" in profile:
        force = force + profile["interaction_force_density"]
    residual = -np.gradient(flux[:, :, a], place, axis=0) + force
    # A cell holds grains down to its own middle: half of its weight lies above that.
    step = place[1] - place[0]
    above = (np.cumsum(force[::-1, a])[::-1] - 0.5 * force[:, a]) * step
    occupied = np.flatnonzero(rho > 0.05 * rho.max())
    inside = 2.0 * profile.cutoff
    bulk = (place > place[occupied[0]] + inside) & (place < place[occupied[-1]] - inside)
    weight = rho.sum() * np.linalg.norm(gravity)
    return Balance(
        place,
        residual,
        rho.max() * np.linalg.norm(gravity),
        bulk,
        flux[:, a, a],
        -above,
        float(residual[:, a].sum() / weight),
    )


@dataclass(frozen=True)
class WidthStudy:
    """Means over one core of the profile for each width [d]; `plateau`: for each field the widths
    between which it stays within FLAT of its value at the reference width.
    """

    source: str
    widths: np.ndarray
    means: dict[str, np.ndarray]
    plateau: dict[str, tuple[float, float]]


def width_study(source: Source, folder: Path, along: str, width: float, words: list[str]):
    """Maps the frame that `words` name with every width; None where no core is left."""
    widths = np.array(sorted({*WIDTHS, width}))
    found = []
    for i, one in enumerate(widths):
        path = folder / f"width_{i}.h5"
        (profile,) = mapped([source], path, along, *words, "--width", str(one))[source.name]
        path.unlink()
        found.append(profile)
    reference = found[int(np.argmin(abs(widths - width)))]
    rho, place = reference["density"], reference.place
    dense = np.flatnonzero(rho > 0.8 * np.median(rho[rho > 0.5 * rho.max()]))
    margin = 3.0 * reference.diameter
    low, high = place[dense[0]] + margin, place[dense[-1]] - margin
    if not low < high:
        return None
    means: dict[str, np.ndarray] = {}
    for field in ("solid_fraction", *TEMPERATURES, "pressure", "stress_ratio"):
        if field in reference:
            means[field] = np.array([mean_between(one, field, low, high) for one in found])
    plateau = {field: flat(widths, values, width) for field, values in means.items()}
    return WidthStudy(source.name, widths, means, plateau)


def mean_between(profile: Profile, field: str, low: float, high: float) -> float:
    values = profile[field][(profile.place > low) & (profile.place < high)]
    values = values[np.isfinite(values)]
    return float(values.mean()) if len(values) else float("nan")


def flat(widths: np.ndarray, values: np.ndarray, width: float) -> tuple[float, float]:
    """The widths about the reference between which the values stay within FLAT of it."""
    k = int(np.argmin(abs(widths - width)))
    near = abs(values - values[k]) <= FLAT * abs(values[k])
    low = high = k
    while low > 0 and near[low - 1]:
        low -= 1
    while high + 1 < len(widths) and near[high + 1]:
        high += 1
    return float(widths[low]), float(widths[high])
