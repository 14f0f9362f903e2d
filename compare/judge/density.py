"""The pressure that a law has at the grains' own void ratio, where that question is well posed.

Near e_c the pressure of a law rises without bound, so that the void ratio, which is known to some
thousandths, says nothing of it: there the answer is refused.
"""

import numpy as np

from compare.judge import bias
from compare.judge.flow import Cells
from compare.judge.laws import Answers, logs

WHY = "p(e) of a law has a pole near e_c"
ILL_POSED = 1.5  # factor in p that the uncertainty of e may make


def rows(answers: Answers, runs: list[list[Cells]]) -> tuple[list[dict], list[str]]:
    """A row "pressure", given "e, gdot", per place in which it is well posed, and a sentence on
    those in which it is not.

    The uncertainty of e is half the range of its mean over packings and widths.
    """
    if not answers.dilates:
        return [], []
    found, refused = [], {}
    all_cells = [cells for packing in runs for cells in packing]
    split = [bias.places(cells) for cells in all_cells]
    told = [at_void_ratio(answers, cells) for cells in all_cells]
    for place in split[0]:
        ratios, slopes, means, shares = [], [], [], []
        for cells, places, (pressure, slope) in zip(all_cells, split, told):
            here = places[place]
            work = np.where(here, cells.work, 0.0)
            if not work.sum() > 0.0:
                continue
            known = here & np.isfinite(pressure)
            if work[known].sum() > 0.0:
                log = np.log(pressure[known] / cells.pressure[known])
                ratios.append(float(np.exp((work[known] * log).sum() / work[known].sum())))
            steep = here & np.isfinite(slope)
            slopes.append(float((work * abs(slope))[steep].sum() / work[steep].sum()))
            means.append(float((work * cells.void_ratio).sum() / work.sum()))
            shares.append(float(work.sum() / cells.work[cells.flowing].sum()))
        if not means or not ratios:
            continue
        factor = float(np.exp(min(0.5 * np.ptp(means) * np.nanmean(slopes), 99.0)))
        if not factor <= ILL_POSED:
            refused[place] = factor
            continue
        found.append(
            {
                "law": answers.label,
                "given": "e, γ̇",
                "place": place,
                "quantity": "pressure",
                "grains": float("nan"),
                "value": float("nan"),
                "ratio": float(np.mean(ratios)),
                "low": min(ratios),
                "high": max(ratios),
                "work": float(np.mean(shares)),
            }
        )
    return found, [sentence(answers.label, refused)] if refused else []


def sentence(label: str, refused: dict[str, float]) -> str:
    worst = max(refused.values())
    return (
        f"{label}: p at the grains' void ratio in {', '.join(refused)} (what e is known to makes a "
        f"factor of up to {worst:.2g} in p)"
    )


def at_void_ratio(answers: Answers, cells: Cells) -> tuple[np.ndarray, np.ndarray]:
    """The law's pressure [Pa] in steady shear at each cell's void ratio and rate, NaN beyond the
    lattice, and |d ln p/d e| at the cell's pressure.
    """
    nodes = answers.steady.axes[0]
    at = logs(cells, answers.diameter, False)
    columns = np.stack(
        [
            answers.steady.at(
                np.column_stack([np.full(len(cells), node), at[:, 1]]), ("void_ratio",)
            )["void_ratio"]
            for node in nodes
        ],
        axis=1,
    )
    pressure, slope = np.full(len(cells), np.nan), np.full(len(cells), np.nan)
    for k in range(len(nodes) - 1):
        left, right = columns[:, k], columns[:, k + 1]
        e = cells.void_ratio
        between = (left >= e) & (e > right)  # void ratio falls with pressure
        part = np.where(between, (left - e) / (left - right), np.nan)
        pressure = np.where(between, np.exp(nodes[k] + part * (nodes[k + 1] - nodes[k])), pressure)
        here = (at[:, 0] >= nodes[k]) & (at[:, 0] < nodes[k + 1])
        slope = np.where(here, (nodes[k + 1] - nodes[k]) / (left - right), slope)
    return pressure, slope
