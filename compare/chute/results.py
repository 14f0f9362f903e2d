"""What RESULTS.md says of a steady flow down a plane, from the tables in cases/chute/reference."""

import math
from pathlib import Path

from cases.programs import ROOT
from compare.study.shown import markdown, origin, per_cent, read

FOLDER = ROOT / "cases" / "chute" / "reference"
SHOWN = ("solid_fraction", "inertial_number", "temperature_ratio")


def values() -> dict[str, str]:
    """Of the page's template."""
    return {
        "steady": steady(FOLDER / "steady.csv"),
        "steady_origin": origin(FOLDER / "steady.csv"),
        "start": start(FOLDER / "start.csv"),
        "start_origin": origin(FOLDER / "start.csv"),
        "ladder": ladder(FOLDER / "ladder" / "ladder.csv"),
        "ladder_origin": origin(FOLDER / "ladder" / "ladder.csv"),
        "judge": judge(FOLDER / "judge" / "overall.csv"),
        "judge_origin": origin(FOLDER / "judge" / "overall.csv"),
    }


def told(row, name: str) -> str:
    """A figure, with the scatter of the packings where there are several."""
    if math.isnan(row[name]):
        return "–"
    deviation = row.get(f"{name}_deviation", math.nan)
    return f"{row[name]:.3f}" + ("" if math.isnan(deviation) else f" ± {deviation:.1g}")


def steady(path: Path) -> str:
    """Grains and laws at the case's depth, by inclination."""
    table = read(path)
    own = table[table["engine"] == "mpm"]["height"].iloc[0]
    rows = []
    for _, row in (
        table[table["height"] == own].sort_values("inclination", kind="stable").iterrows()
    ):
        of_grains = row["engine"] == "dem"
        balance = max(row["normal_balance"], row["shear_balance"])
        rows.append(
            [
                f"{row['inclination']:g}°",
                "grains" if of_grains else row["law"].replace("_", " "),
                row["state"],
                *(told(row, name) for name in SHOWN),
                "–" if math.isnan(balance) else per_cent(balance, 2),
                str(int(row["packings"])) if of_grains else "–",
            ]
        )
    head = ["θ", "of", "", "solid fraction", "I", "T/(γ̇ d)²", "balance at worst", "packings"]
    return markdown(head, rows)


def start(path: Path) -> str:
    """Where layers start and stop, as the head of the table says it."""
    lines = [line[2:] for line in path.read_text().splitlines() if line.startswith("# ")]
    found = [line for line in lines if " between " in line and line.endswith(" deg")]
    rows = []
    for line in found:
        engine, rest = line.split(": ")
        what, places = rest.split(" between ")
        low, high = places.removesuffix(" deg").split(" and ")
        who = "grains" if engine == "dem" else "contact share, `contact_mu05`"
        does = "from rest, starts" if what == "start" else "flowing, stops"
        rows.append([who, does, f"{low}° and {high}°"])
    return markdown(["layer of", "", "between"], rows)


def ladder(path: Path) -> str:
    rows = [
        [
            row["rung"],
            row["verdict"],
            "–"
            if math.isnan(row["error"])
            else f"{per_cent(row['error'])} ± {per_cent(row['half_width'])}",
            "–" if math.isnan(row["cost"]) else f"{row['cost']:.2g} s",
        ]
        for _, row in read(path).iterrows()
    ]
    return markdown(["rung", "verdict", "velocity off by", "cost per √(H/g)"], rows)


def judge(path: Path) -> str:
    """Bias of each law in the grains' flow."""
    rows = []
    for _, row in read(path).iterrows():
        span = f"{per_cent(row['from'])} to {per_cent(row['to'])}"
        heat = row["T ratio"]
        void = row["e difference"]
        rows.append(
            [
                row["law"].replace("_", " "),
                f"{100.0 * row['bias of μ_D']:+.1f} %",
                span,
                "–" if math.isnan(heat) else f"{heat:.2f}",
                "–" if math.isnan(void) else f"{void:+.3f}",
            ]
        )
    return markdown(["law", "bias of μ_D", "range", "T over the grains'", "e − the grains'"], rows)
