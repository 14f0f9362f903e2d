"""What a paired run will take of this machine or another: both engines and the comparison."""

import sys
from dataclasses import dataclass

from cases import cost
from cases.case import Case
from cases.cost import Cost
from cases.scenes import floor_length
from compare.verdict.siblings import COARSER
from dem_reference import cost as grains_cost
from dem_reference.packing import dict_of


@dataclass(frozen=True)
class Estimate:
    """Of one continuum, its siblings or none, and `seeds` runs of the grains."""

    mpm: Cost
    dem: Cost
    fields: float  # disk [bytes]
    seeds: int = 1
    siblings: bool = True

    @property
    def continuum(self) -> tuple[float, float]:
        """Seconds of a processor and bytes of disk, siblings included: each has 1/1.6 of the steps
        and 1/1.6^2 of the points.
        """
        count = 2 if self.siblings else 0
        return (
            self.mpm.seconds * (1.0 + count / COARSER**3),
            self.mpm.disk * (1.0 + count / COARSER**2),
        )

    @property
    def bytes(self) -> float:
        """Of memory, both engines at a time."""
        return self.mpm.bytes + self.dem.bytes

    @property
    def seconds(self) -> float:
        """Of processors."""
        return self.continuum[0] + self.seeds * self.dem.seconds + comparison()["seconds"]

    @property
    def disk(self) -> float:
        """[bytes]"""
        return self.continuum[1] + self.seeds * self.dem.disk + self.fields + comparison()["disk"]


def comparison() -> dict:
    return cost.rates()["comparison"]


def estimate(case: Case, seeds: int = 1, siblings: bool = True) -> Estimate:
    """Raises CaseError where an engine refuses the case."""
    geometry, side = case["geometry"], case["compare.spacing"] * case["grains.diameter"]
    cells = floor_length(geometry) * geometry["height"] / side**2
    frames = case["time.maximum"] / case["time.frame_interval"] + 1.0
    mapped = 1 + seeds + (2 if siblings else 0)
    fields = comparison()["disk_per_cell"] * mapped * cells * frames
    grains = grains_cost.estimate(dict_of(case))
    return Estimate(cost.continuum(case), grains, fields, seeds, siblings)


def refuse_more_than_there_is(case: Case, of: Estimate):
    """Raises CaseError where either engine takes more memory than there is."""
    cost.refuse_more_than_there_is(
        f"{case.path}: mpm.cell_size = {case['mpm.cell_size']:g} m",
        of.mpm,
        "choose larger cells, or fewer mpm.points_per_cell",
    )
    cost.refuse_more_than_there_is(
        f"{case.path}: grains.diameter = {case['grains.diameter']:g} m",
        of.dem,
        "choose larger grains, or dem.coarsening",
    )


def tell_if_long(case: Case, of: Estimate):
    """One line on standard error, before hours go by."""
    if of.seconds > cost.LONG:
        print(
            f"{case.path}: takes about {cost.duration(of.seconds)} of processor time "
            "(--dry-run shows what for)",
            file=sys.stderr,
        )


def table(of: Estimate) -> str:
    """A few lines for a reader."""
    rows = [f"{'':<16}{'what':<36}{'memory':>10}{'steps':>10}{'processor':>12}{'disk':>10}"]
    for name, one, times in (("continuum", of.mpm, 1), ("grains", of.dem, of.seeds)):
        counts = ", ".join(f"{count:,.0f} {what}" for what, count in one.counts.items())
        rows.append(
            f"{name + (f' × {times}' if times > 1 else ''):<16}{counts:<36}{size(one.bytes):>10}"
            f"{one.steps:>10.3g}{cost.duration(times * one.seconds):>12}"
            f"{size(times * one.disk):>10}"
        )
    if of.siblings:
        seconds, disk = (
            both - own for both, own in zip(of.continuum, (of.mpm.seconds, of.mpm.disk))
        )
        rows.insert(2, f"{'its siblings':<72}{cost.duration(seconds):>12}{size(disk):>10}")
    total = cost.duration(of.seconds)
    rows.append(f"{'with comparison':<62}{total:>22}{size(of.disk):>10}")
    return "\n".join(rows)


def size(count: float) -> str:
    return f"{count / 1e9:.3g} GB" if count >= 1e9 else f"{count / 1e6:.3g} MB"
