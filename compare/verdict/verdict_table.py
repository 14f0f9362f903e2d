"""The verdicts of a comparison, its negative controls beside them, as a small table to keep:
verdicts.csv.
"""

from pathlib import Path

import pandas as pd

from compare.verdict.conclusion import headline
from compare.verdict.controls import WORDS
from cases.files import write_table

ENTRIES = {
    "unit": "unit",
    "mpm": "continuum",
    "dem": "grains",
    "margin": "margin",
    "half_width": "half_width",
    "numerical_uncertainty": "numerical_uncertainty",
    "verdict": "verdict",
}


def table(metrics: dict) -> pd.DataFrame:
    """One row per metric that has a margin, from the entries of metrics.json.

    continuum, grains: means; grains_deviation: standard deviation between packings; difference of
    the means, or the distance itself; half_width: of the difference's 90 % confidence interval;
    numerical_uncertainty: what widens it besides; a column per negative control.
    """
    controls = [name for name in WORDS if f"control_{name}" in metrics]
    rows = []
    for name, entry in metrics.items():
        if "verdict" not in entry:
            continue
        row = {"metric": name} | {column: entry.get(key) for key, column in ENTRIES.items()}
        row["grains_deviation"] = entry.get("dem_std", entry.get("std", entry.get("stored_std")))
        row["difference"] = entry.get("difference", entry.get("value"))
        rows.append(
            row | {control: metrics[f"control_{control}"]["words"][name] for control in controls}
        )
    order = [
        "metric",
        "unit",
        "continuum",
        "grains",
        "grains_deviation",
        "difference",
        "half_width",
        "numerical_uncertainty",
        "margin",
        "verdict",
        *controls,
    ]
    return pd.DataFrame(rows)[order]


def write(metrics: dict, runs: list, path: Path, command: str) -> None:
    """The table as CSV below comment lines that say which runs it is of; appears complete or not at
    all.
    """
    commits = ", ".join(sorted({f"{run.engine} {run.attributes['commit']}" for run in runs}))
    judged = {"verdict": headline(metrics)} | {
        name: entry["value"] for name, entry in metrics.items() if name.startswith("control_")
    }
    seeds = " ".join(str(run.attributes["seed"]) for run in runs if run.engine == "dem")
    header = [
        f"command: {command}",
        f"runs made by: {commits}; seeds of the grains: {seeds}",
        "overall: " + "; ".join(f"{name} {word}" for name, word in judged.items()),
    ]
    write_table(path, header, table(metrics))
