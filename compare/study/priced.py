"""What RESULTS.md says of a frontier: what an error, and what an answer of each law costs."""

import math

import pandas as pd

from cases import case
from cases.programs import ROOT
from compare.study import frontier
from compare.study.distance import WORDS
from compare.study.shown import law_of, markdown, origin, per_cent, times

ERRORS = ("run_out", "deposit", "kinetic", "dissipation", "temperature")


def values(name: str) -> dict:
    """Of a case: the cheapest recipe at each level, and every law on the case's own cells."""
    folder = ROOT / "cases" / name / "reference"
    points, reference = frontier.committed(name)
    grains = frontier.grain_cost(reference)
    size = float(case.load(ROOT / "cases" / name)["mpm.cell_size"])
    told = [one for one in ERRORS if not math.isnan(frontier.band(reference, one))]
    bands = [
        f"{per_cent(frontier.band(reference, one))} in {one.replace('_', '-')}" for one in told
    ]
    return {
        "name": name,
        "origin": origin(folder / "frontier" / "points.csv"),
        "levels": levels(points, grains),
        "laws": laws(points, grains, size),
        "converged": converged(points, grains),
        "size": 1000.0 * size,
        "grains": f"{grains:.2g}",
        "seeds": len(reference["members"]),
        "scatter": ", ".join(bands),
        "runs": int((~points["fine"]).sum()),
        "failed": int((points["status"] != "ok").sum()),
        "seen": "Error of the deposit over cost. "
        + front_in_words(points[~points["fine"]], "error_deposit")
        + f" Shaded: the grains' own scatter, {per_cent(frontier.band(reference, 'deposit'))}",
        "seen_numerical": "Distance of the deposit from the law's own fine solution, over cost. "
        + front_in_words(points[~points["fine"] & (points["engine"] == "mpm")], "numerical_deposit")
        + " Dashed lines are what each law itself is off by from the grains",
    }


def front_in_words(points: pd.DataFrame, column: str) -> str:
    """From where to where the front of a chart falls, and what lies off it."""
    good = points[(points["status"] == "ok") & points[column].notna()]
    ahead = good.iloc[frontier.front(good["cost"].to_numpy(), good[column].to_numpy())]
    ends = " to ".join(
        f"{per_cent(row[column])} at {row['cost']:.2g} s per √(H/g) ({row['label']})"
        for _, row in ahead.sort_values("cost").iloc[[0, -1]].iterrows()
    )
    failed = int((points["status"] != "ok").sum())
    return (
        f"The front of {len(ahead)} recipes falls in steps from {ends}; the other "
        f"{len(good) - len(ahead)} lie above it, {failed} that failed along the upper edge."
    )


def levels(points: pd.DataFrame, grains: float) -> str:
    """The cheapest recipe whose error is within each level, for each error."""
    metrics = [one for one in ERRORS if points[f"error_{one}"].notna().any()]

    def cheapest(level: float, metric: str) -> str:
        found = frontier.best(points, metric, level)
        if found is None:
            return "the grains alone"
        error = per_cent(found[f"error_{metric}"])
        return f"{found['label']} ({error}): {times(found['cost'], grains)} ×"

    rows = [
        [per_cent(level, 0), *(cheapest(level, one) for one in metrics)]
        for level in frontier.LEVELS
    ]
    return markdown(["within", *(WORDS[one] for one in metrics)], rows)


def laws(points: pd.DataFrame, grains: float, size: float) -> str:
    """Every law and card on cells of `size` [m], nothing else changed."""
    rows = [
        [
            law_of(row),
            *(per_cent(row[f"error_{one}"]) for one in ERRORS),
            per_cent(row["numerical_deposit"]),
            times(row["cost"], grains),
        ]
        for _, row in frontier.on_cells(points, size).iterrows()
    ]
    names = [one.replace("_", "-") for one in ERRORS]
    return markdown(["law", *names, "numerical", "× cheaper"], rows)


def converged(points: pd.DataFrame, grains: float) -> str:
    """Of every law and card that has a fine solution, the cheapest recipe near to it."""
    rows = []
    fine = points[points["fine"] & (points["status"] == "ok")]
    for _, law in fine.fillna({"card": ""}).iterrows():
        row = [law_of(law)]
        for level in frontier.NUMERICAL_LEVELS:
            found = frontier.converged(points, law["law"], law["card"], level)
            row.append(
                "–"
                if found is None
                else f"{found['label']}: {times(found['cost'], grains)} × "
                f"({per_cent(found['numerical_deposit'])}, {per_cent(found['numerical_run_out'])}, "
                f"{per_cent(found['numerical_temperature'])})"
            )
        rows.append(row)
    levels_named = [f"within {per_cent(level, 0)}" for level in frontier.NUMERICAL_LEVELS]
    return markdown(["law", *levels_named], rows)
