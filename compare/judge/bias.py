"""The law's answer over the grains' in what flows, by zone and inertial number, weighted by work.

Under the conditions of every cell, (p, gdot) or (p, gdot, T):

    friction     sum W mu_law/mu_D over sum W with W the work of a cell: the work that the law would
                 do there over the grains'
    others       of |s|/p the ratio of means weighted by work, of T its geometric mean, of Gamma the
                 ratio of sums, of e the difference of means
"""

from dataclasses import dataclass

import numpy as np

from compare.judge.flow import ZONES, Cells
from compare.judge.laws import Answers

# Edges of the bins of inertial number.
BINS = (0.0, 0.03, 0.06, 0.1, 0.2, 0.4, 1.0, np.inf)
QUANTITIES = ("friction", "stress_ratio", "coaxiality", "temperature", "dissipation", "void_ratio")
OVERALL = "all that flows"


@dataclass(frozen=True)
class Figure:
    """Of one quantity in one place: the grains' mean, the law's, and how they compare."""

    grains: float
    law: float
    ratio: float  # of void ratios the difference


def places(cells: Cells) -> dict[str, np.ndarray]:
    """The cells (n,) of what is told apart: all that flows, each zone but the one at rest, and bins
    of inertial number of what flows.
    """
    found = {OVERALL: cells.flowing}
    found |= {ZONES[k]: cells.zone == k for k in range(1, len(ZONES))}
    for low, high in zip(BINS, BINS[1:]):
        inside = (cells.inertial_number >= low) & (cells.inertial_number < high)
        found[f"I {low:g}–{high:g}" if np.isfinite(high) else f"I > {low:g}"] = (
            cells.flowing & inside
        )
    return found


def figure(quantity: str, cells: Cells, answer: dict[str, np.ndarray]) -> Figure:
    """Of cells and the law's answer to each (ANSWERS of laws.py)."""
    work = cells.work
    grains, law = observed(quantity, cells), predicted(quantity, answer)
    known = np.isfinite(grains) & np.isfinite(law)
    if quantity == "temperature":
        known &= (grains > 0.0) & (law > 0.0)
    weight, grains, law = work[known], grains[known], law[known]
    if not weight.sum() > 0.0:
        return Figure(*[float("nan")] * 3)
    if quantity in ("friction", "coaxiality", "stress_ratio"):
        # Power for power: a weight with the grains' friction in it would cancel it.
        base = cells.unit_work[known]
        if quantity == "coaxiality":
            base = base * cells.stress_ratio[known]
        a, b = (float((base * one).sum() / base.sum()) for one in (grains, law))
        return Figure(a, b, b / a)
    if quantity == "dissipation":
        volume = cells.weight[known]
        a, b = (float((volume * one).sum() / volume.sum()) for one in (grains, law))
        return Figure(a, b, b / a)
    if quantity == "temperature":
        a, b = (float(np.exp((weight * np.log(one)).sum() / weight.sum())) for one in (grains, law))
        return Figure(a, b, b / a)
    a, b = (float((weight * one).sum() / weight.sum()) for one in (grains, law))
    return Figure(a, b, b - a)


def observed(quantity: str, cells: Cells) -> np.ndarray:
    if quantity == "coaxiality":
        return cells.friction / cells.stress_ratio
    return getattr(cells, quantity)


def predicted(quantity: str, answer: dict[str, np.ndarray]) -> np.ndarray:
    if quantity == "coaxiality":
        with np.errstate(invalid="ignore"):  # no stress, no direction
            return answer["friction"] / answer["stress_ratio"]
    return answer[quantity]


def rows(answers: Answers, runs: list[list[Cells]]) -> list[dict]:
    """A row per condition, place and quantity. `runs`: for each packing the cells of every width.

    ratio: mean over packings and widths; low, high: the range over them; work: share of the work
    that the place has in all that flows.
    """
    found: dict[tuple, list[tuple[Figure, float]]] = {}
    for packing in runs:
        for cells in packing:
            total = cells.work[cells.flowing].sum()
            split = places(cells)
            for held in (False, True) if answers.held is not None else (False,):
                answer = answers.to(cells, held)
                for place, mask in split.items():
                    one = cells.where(mask)
                    here = {name: values[mask] for name, values in answer.items()}
                    for quantity in QUANTITIES:
                        if not tells(answers, quantity, held):
                            continue
                        key = ("p, γ̇, T" if held else "p, γ̇", place, quantity)
                        share = float(one.work.sum() / total)
                        found.setdefault(key, []).append((figure(quantity, one, here), share))
    return [
        {"law": answers.label, "given": given, "place": place, "quantity": quantity}
        | summary(figures)
        for (given, place, quantity), figures in found.items()
    ]


def tells(answers: Answers, quantity: str, held: bool) -> bool:
    """Whether the law answers by itself: not to what is given, nor of what it does not know."""
    if quantity == "temperature":
        return answers.fluctuates and not held
    return quantity != "void_ratio" or answers.dilates


def summary(figures: list[tuple[Figure, float]]) -> dict:
    known = [(one, share) for one, share in figures if np.isfinite(one.ratio)]
    if not known:
        return dict.fromkeys(("grains", "value", "ratio", "low", "high", "work"), float("nan"))
    ratios = [one.ratio for one, _ in known]
    return {
        "grains": float(np.mean([one.grains for one, _ in known])),
        "value": float(np.mean([one.law for one, _ in known])),
        "ratio": float(np.mean(ratios)),
        "low": min(ratios),
        "high": max(ratios),
        "work": float(np.mean([share for _, share in known])),
    }
