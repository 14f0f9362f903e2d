"""What others have measured of collapsing columns (cases/published.toml)."""

import tomllib
from dataclasses import dataclass, field

import numpy as np

from cases.programs import ROOT
from cases.scenes import is_silo

FIGURES = ("run_out", "height", "discharge")


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
class Beverloo:
    """factor (1 - empty/x)^(3/2) for slots x from `low` to `high` [d]: the outermost grains of a
    slot do not count.
    """

    low: float
    high: float
    factor: float
    empty: float

    def __call__(self, x):
        return self.factor * (1.0 - self.empty / np.asarray(x)) ** 1.5


@dataclass(frozen=True)
class Published:
    """`laws` and `points` (n, 2) of aspect ratio, or width of a slot [d], and value, by figure:
    run-out and height [L0], discharge.
    """

    name: str
    source: str
    laws: dict[str, list[Piece | Beverloo]] = field(default_factory=dict)
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


def of(geometry: dict) -> list[Published]:
    """Of scenes like that of a case's table [geometry]."""
    if is_silo(geometry):
        return read("silo")
    return read("axisymmetric" if geometry["dimension"] == "axisymmetric" else "plane")


def read(geometry: str) -> list[Published]:
    """Of columns that are "plane" or "axisymmetric", or of a "silo"."""
    found = tomllib.loads((ROOT / "cases" / "published.toml").read_text())[geometry]
    return [
        Published(
            one["name"],
            one["source"],
            {name: [law(piece) for piece in one[name]] for name in FIGURES if name in one},
            {name: np.array(one[f"{name}_points"]) for name in FIGURES if f"{name}_points" in one},
        )
        for one in found
    ]


def law(told: dict) -> Piece | Beverloo:
    ends = told["from"], told["to"], told["factor"]
    return Beverloo(*ends, told["empty"]) if "empty" in told else Piece(*ends, told["power"])


def band(published: list[Published], figure: str, a: float) -> tuple[float, float] | None:
    """Least and most of what is published; None where nothing is."""
    found = [value for one in published if (value := one.at(figure, a)) is not None]
    return (min(found), max(found)) if found else None
