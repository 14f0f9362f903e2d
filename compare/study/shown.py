"""Parts of RESULTS.md: tables as they are read, and as Markdown shows them."""

import math
from pathlib import Path

import pandas as pd

from cases.programs import ROOT

LAWS = {
    "drucker_prager": "Drucker–Prager",
    "mu_i": "μ(I)",
    "lade_duncan": "Lade–Duncan",
    "critical_state": "critical state",
    "solid_fluid": "full model",
    "contact_share": "contact share",
    "external": "a library's law",
}


def read(path: Path) -> pd.DataFrame:
    return pd.read_csv(path, comment="#")


def origin(path: Path) -> str:
    """Where a table comes from: a line of its path, command, commit and date, as its head says."""
    head = " ".join(
        line[2:].strip() for line in path.read_text().splitlines() if line.startswith("# ")
    )

    def told(word: str) -> str:
        return head.split(f"{word}: ", 1)[1].split()[0].rstrip(";,") if f"{word}: " in head else "?"

    return f"`{path.relative_to(ROOT)}`, commit {told('commit')}, {told('date')}"


def markdown(head: list[str], rows: list[list[str]]) -> str:
    return "\n".join(f"| {' | '.join(row)} |" for row in [head, ["---"] * len(head), *rows])


def per_cent(value: float, digits: int = 1) -> str:
    return "–" if math.isnan(value) else f"{100.0 * value:.{digits}f} %"


def times(price: float, grains: float) -> str:
    factor = grains / price if price else math.nan
    return "–" if math.isnan(factor) else f"{factor:.2g}" if factor < 10 else f"{factor:.0f}"


def law_of(row) -> str:
    return LAWS.get(row["law"], row["law"]) + (
        f", `{row['card']}`" if row["law"] in ("solid_fluid", "contact_share") else ""
    )
