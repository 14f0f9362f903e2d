"""Charts of a trial of laws, one file each. Here what they share."""

import numpy as np
from matplotlib import colormaps

from compare.judge.flow import Cells
from compare.judge.laws import Answers
from compare.judge.trial import Trial

NAME = {"dem": "grains", "mpm": "what the continuum visits"}
# Edges of the bins that curves are drawn through.
EDGES = np.geomspace(0.02, 1.5, 14)
LEAST_WORK = 0.002  # share of all work below which a bin is noise


def styles(trial: Trial) -> dict[str, dict]:
    """Colour and line of each law by its label: a colour per law, a line per set of constants."""
    laws = list(dict.fromkeys(one.candidate.law for one in trial.laws))
    lines = ("-", "--", ":", "-.", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 3)))
    found = {}
    for k, law in enumerate(laws):
        of_law = [one for one in trial.laws if one.candidate.law == law]
        for i, one in enumerate(of_law):
            found[one.label] = {
                "color": colormaps["tab10"](k),
                "linestyle": lines[i % len(lines)],
                "label": one.label,
            }
    return found


def binned(cells: Cells, values: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Weighted means of `values` over the bins of inertial number in what flows; NaN where too
    little work is done for one.
    """
    mask = cells.flowing & np.isfinite(values) & np.isfinite(weight)
    total = cells.work[cells.flowing].sum()
    place = np.digitize(cells.inertial_number[mask], EDGES) - 1
    inside = (place >= 0) & (place < len(EDGES) - 1)

    def summed(one):
        return np.bincount(place[inside], one[mask][inside], len(EDGES) - 1)

    enough = summed(cells.work) > LEAST_WORK * total
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(enough, summed(weight * values) / summed(weight), np.nan)


def middle(edges: np.ndarray = EDGES) -> np.ndarray:
    return np.sqrt(edges[1:] * edges[:-1])


def each(trial: Trial) -> list[Cells]:
    return [cells for packing in trial.runs for cells in packing]


def band(ax, curves: list[np.ndarray], label: str):
    """The mean of curves over packings and widths, within their range."""
    stack = np.array(curves)
    known = np.isfinite(stack).all(axis=0)
    x, stack = middle()[known], stack[:, known]
    ax.fill_between(x, stack.min(axis=0), stack.max(axis=0), color="#26292e", alpha=0.15, lw=0)
    ax.plot(x, stack.mean(axis=0), "o-", color="#26292e", ms=3.5, label=label, zorder=5)


def curve(ax, curves: list[np.ndarray], style: dict):
    stack = np.array(curves)
    known = np.isfinite(stack).all(axis=0)
    ax.plot(middle()[known], stack[:, known].mean(axis=0), lw=1.4, **style)


def answered(answers: Answers, cells: Cells, name: str, held: bool = False) -> np.ndarray:
    return answers.to(cells, held, (name,))[name]


def over_inertial_number(ax, label: str):
    ax.set(xscale="log", xlabel="inertial number I = γ̇ d √(ρ_s/p)", ylabel=label)
    low, high = ax.get_xlim()
    ticks = [one for one in (0.02, 0.05, 0.1, 0.2, 0.5, 1.0) if low <= one <= high]
    ax.set_xticks(ticks, [f"{one:g}" for one in ticks])
    ax.minorticks_off()
