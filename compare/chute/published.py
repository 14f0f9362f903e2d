"""What others have found of steady flows down a rough plane (cases/published.toml), and what it
makes of one inclination.
"""

import tomllib
from dataclasses import dataclass

from cases.programs import ROOT
from compare.chute.flow import inertial_number


@dataclass(frozen=True)
class Fact:
    """A published value of a figure at one inclination."""

    figure: str
    value: float
    name: str
    source: str


def read() -> list[dict]:
    return tomllib.loads((ROOT / "cases" / "published.toml").read_text())["chute"]


def at(inclination: float, inertial: float) -> list[Fact]:
    """Facts of an inclination [deg] and of a flow of that inertial number."""
    out = []
    for one in read():
        name, source = one["name"], one["source"]
        if "profile" in one:
            out.append(Fact("bagnold", one["profile"], name, source))
        if law := one.get("solid_fraction"):
            out.append(Fact("solid_fraction", law["loose"] - law["slope"] * inertial, name, source))
        if law := one.get("friction"):
            found = inertial_number(inclination, law["static"], law["dynamic"], law["reference"])
            out.append(Fact("inertial_number", found, name, source))
    return out
