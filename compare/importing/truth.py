"""Masses, diameters and densities: the file's columns first, then what the user says, then the
case; and where they disagree.
"""

from dataclasses import dataclass

import numpy as np

from cases.case import Case
from cases.errors import CaseError
from compare.importing.series import Grains
from dem_reference.grains import mapped_diameter, moments

SAID = 0.01  # relative: a disagreement that is said
REFUSED = 3.0  # a factor of lengths beyond which it is another scene, or another unit


@dataclass(frozen=True)
class Matter:
    """How grains get their mass where the file does not tell it: `density` [kg/m3]."""

    density: float | None

    def masses(self, grains: Grains) -> np.ndarray:
        """(N,) [kg]. Raises CaseError where nobody tells it."""
        if grains.mass is not None:
            return grains.mass
        if grains.density is not None:
            return grains.density * grains.volume
        if self.density is None:
            raise CaseError(
                f"{grains.source}: no column mass or density (how heavy are the grains?) give "
                "--density"
            )
        return self.density * grains.volume


def matter(first: Grains, asked: float | None, scene: Case | None, notes: list[str]) -> Matter:
    """What the density is taken from; says what it is assumed from, or contradicts."""
    told = first.mass is not None or first.density is not None
    if told:
        own = float(Matter(None).masses(first).sum() / first.volume.sum())
        if asked is not None:
            disagree("density", own, asked, " kg/m3", "--density", notes)
        return Matter(None)
    if asked is None and scene is not None:
        notes.append(f"assumed: the case's density, {scene['grains.density']:g} kg/m3")
        return Matter(scene["grains.density"])
    return Matter(asked)


def disagree(what: str, own: float, other: float, unit: str, whose: str, notes: list[str]):
    """Notes a disagreement above SAID."""
    if abs(own / other - 1.0) > SAID:
        size = (
            f"{100 * (own / other - 1.0):+.0f} %"
            if 0.5 < own / other < 2
            else f"{own / other:.3g} times"
        )
        notes.append(f"disagrees: {what} {own:.4g}{unit}, {whose} {other:.4g} ({size})")


@dataclass(frozen=True)
class Sizes:
    """Diameters of grains that move [m]: d43 = Σd⁴/Σd³, the smallest, the largest; density Σm/ΣV
    [kg/m3], mass [kg] and number of them.
    """

    d43: float
    smallest: float
    largest: float
    density: float
    mass: float
    count: int

    @classmethod
    def of(cls, radius: np.ndarray, mass: np.ndarray) -> "Sizes":
        d = 2.0 * radius
        volume = np.pi / 6.0 * np.sum(d**3)
        return cls(
            float(np.sum(d**4) / np.sum(d**3)),
            float(d.min()),
            float(d.max()),
            float(mass.sum() / volume),
            float(mass.sum()),
            len(d),
        )


def column(scene: Case) -> np.ndarray:
    """Length, height and thickness of a case's column [m]."""
    return np.array([scene[f"geometry.{name}"] for name in ("length", "height", "thickness")])


def refuse_other_scene(what: str, own: float, other: float, source: str):
    """Raises CaseError where a length of the grains is none of the case's by far."""
    if not 1.0 / REFUSED <= own / other <= REFUSED:
        raise CaseError(
            f"{source}: {what} {own:.4g} m, the case's {other:.4g} m (another scene, or other "
            "units) see --units"
        )


def against_case(
    sizes: Sizes, extent: np.ndarray, span: float | None, scene: Case, source: str, notes: list[str]
):
    """Notes in what the grains differ from the case: `extent` (3,) [m] along x, y, z at the first
    frame, `span` [s] of the frames. Raises CaseError beyond the factor REFUSED.
    """
    size = column(scene)
    for what, own, other in (
        ("diameter", sizes.d43, mapped_diameter(scene["grains"])),
        *zip(("length", "height", "thickness"), extent, size),
    ):
        refuse_other_scene(what, own, other, source)
        disagree(what, float(own), float(other), " m", "the case", notes)
    rho = scene["grains.density"]
    d, grains = scene["grains.diameter"], scene["grains"]
    third, _ = moments(grains.get("sizes", "uniform"), grains.get("size_spread", 0.0))
    one = np.pi / 6.0 * d**3 * third
    solid = float(np.prod(size)) / (1.0 + scene["initial.void_ratio"])
    disagree("density", sizes.density, rho, " kg/m3", "the case", notes)
    disagree("mass", sizes.mass, solid * rho, " kg", "the case", notes)
    disagree("number of grains", sizes.count, solid / one, "", "the case", notes)
    if span:
        scale = float(np.sqrt(scene["geometry.height"] / scene["geometry.gravity"]))
        most = scene["time.maximum"]
        if span < 0.99 * most * scale:
            notes.append(
                f"disagrees: the frames end at {span / scale:.2g} √(H/g), the case's runs at rest "
                f"or at {most:g}"
            )
