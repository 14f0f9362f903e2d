"""What others have measured of collapsing columns (cases/published.toml)."""

import tomllib
from dataclasses import dataclass, field

import numpy as np

from cases.programs import ROOT

FIGURES = ("run_out", "height")


@dataclass(frozen=True)
class Piece:
    """factor a^power for aspect ratios a from `low` to `high`."""

    low: float
    high: float
    factor: float
    power: float

    def __call__(self, a):
        return self.factor * np.asarray(a) ** self.power


@dataclass(frozen=True)
class Published:
    """`laws` and `points` (n, 2) of aspect ratio and value, by figure: run-out and height [L0]."""

    name: str
    source: str
    laws: dict[str, list[Piece]] = field(default_factory=dict)
    points: dict[str, np.ndarray] = field(default_factory=dict)

    def at(self, figure: str, a: float) -> float | None:
        """What is published of an aspect ratio: a point, else the law; None beyond both."""
        for x, value in self.points.get(figure, []):
            if np.isclose(x, a):
                return float(value)
        for piece in self.laws.get(figure, []):
            if piece.low <= a <= piece.high:
                return float(piece(a))
        return None


def of(dimension: str) -> list[Published]:
    """Of columns like those of a case, by its geometry.dimension."""
    return read("axisymmetric" if dimension == "axisymmetric" else "plane")


def read(geometry: str) -> list[Published]:
    """Of columns that are "plane" or "axisymmetric"."""
    found = tomllib.loads((ROOT / "cases" / "published.toml").read_text())[geometry]
    return [
        Published(
            one["name"],
            one["source"],
            {
                name: [Piece(p["from"], p["to"], p["factor"], p["power"]) for p in one[name]]
                for name in FIGURES
                if name in one
            },
            {name: np.array(one[f"{name}_points"]) for name in FIGURES if f"{name}_points" in one},
        )
        for one in found
    ]


def band(published: list[Published], figure: str, a: float) -> tuple[float, float] | None:
    """Least and most of what is published; None where nothing is."""
    found = [value for one in published if (value := one.at(figure, a)) is not None]
    return (min(found), max(found)) if found else None
