"""What the page of results says of refinement (compare/study/refinement.py)."""

import math
from pathlib import Path

from compare.study import refinement
from compare.study.charts import refinement as chart
from compare.study.shown import markdown, origin, per_cent, read


def values(reference: Path, laws: dict[str, str]) -> dict:
    """Each law of `laws`, names by word, on finer and finer cells, the means of its displaced
    starts; those whose deposit comes to no limit, and runs that failed.
    """
    path = reference / "refinement.csv"
    table = read(path)
    rows = []
    for law, part in table.groupby("law", sort=False):
        means = part.groupby("cells").mean(numeric_only=True)
        for cells, row in means.iterrows():
            last = math.isnan(row["to_next"])
            hot = row["fluctuation"] > 0.0
            rows.append(
                [
                    f"**{laws[str(law)]}**" if cells == means.index[0] else "",
                    f"{cells}",
                    f"{row['run_out_95']:.3f}",
                    f"{row['height']:.3f}",
                    per_cent(row["peak"]),
                    *(
                        f"{100.0 * row[one]:.3f} %" if hot else "–"
                        for one in ("fluctuation", "fluctuation_above")
                    ),
                    "–" if last else f"{row['to_next']:.4f}",
                    f"{row['apart']:.4f}",
                ]
            )
    names = ["law", "cells", "run-out 95 % [L0]", "height [L0]", "kinetic peak", "fluctuation"]
    names += ["above one d", "moved by the next [L0]", "two starts [L0]"]
    comes = refinement.limits(table)
    lost = [laws[law] for law, limit in comes.items() if not limit]
    failed = [
        f"{laws[row.law]} on {row.cells} cells, start {row.seed}: {row.status}"
        for row in table[table["status"] != "ok"].itertuples()
    ]
    return {
        "origin": origin(path),
        "table": markdown(names, rows),
        "lost": ", ".join(lost) if lost else "none",
        "failed": "; ".join(failed),
        "seen": chart.told(table),
    }
