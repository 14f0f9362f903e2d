"""What refinement does to the collapse of each law: whether the deposit comes to a limit, how far
it is from there, and where the granular temperature is that finer cells find.

    python3 -m compare.study.refinement CASE [--cells N ...] [--laws LAW ...] [--seeds N]

Each law is run on every number of cells in the height, from displaced starts that tell chance from
effect. A run that fails is a row without figures. Writes cases/<case>/reference/refinement.csv and
.png.
"""

import math
import sys
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from cases import command_line
from cases.case import load
from cases.errors import exit_code
from cases.files import check_table, write_table
from cases.provenance import about, head, typed
from cases.scenes import refuse_chute
from compare.mapping.reductions import wasserstein
from compare.mapping.runs import Run
from compare.study import point, redraw
from compare.study.figures import at_end, figures
from compare.study.recipe import Recipe
from compare.study.softening import DISPLACED
from compare.verdict.findings.thin_temperature import energies

LAWS = {
    "drucker_prager": "dem_mu05",
    "mu_i": "dem_mu05",
    "lade_duncan": "dem_mu05",
    "solid_fluid": "dem_mu05",
    "contact_share": "contact_mu05",
}
FIGURES = ("run_out_95", "centre", "height", "peak", "steps", "cpu_seconds_engine")
PATIENCE = 3600.0  # processor seconds; the finest run of the dearest law takes some minutes
UNITS = (
    "to_next, to_finest: distance along x of the deposit from the one of the same start on the "
    "next finer cells, and on the finest (metric wasserstein_x) [L0]; apart: from another start's "
    "on the same cells [L0]; fluctuation: the largest of the frames, all of it and what is more "
    "than a grain's diameter above the base [E0]; run_out_95, centre, height [L0]; peak [of what "
    "is released]; cpu_seconds_engine [s]"
)


def one(scene: Path, law: str, cells: int, seed: int) -> dict:
    """A run of a law, with what `told` makes of it; of one that failed, how (`point.run`)."""
    size = load(scene)["geometry.height"] / cells
    sets = [f"material.law={law}", f"material.card={LAWS[law]}", f"mpm.cell_size={float(size)!r}"]
    sets += [f"mpm.jitter={DISPLACED}", "time.maximum=6", "time.frame_interval=0.25"]
    recipe = Recipe("mpm", tuple(sets), timeout=PATIENCE, seed=seed)
    return {"law": law, "cells": cells, "seed": seed} | point.run(scene, recipe, told)


def told(result: Path) -> dict:
    """Of a result its figures, its fluctuation, and `deposit`, places along x [L0] and masses."""
    run = at_end(result)
    found, end, most = figures(run), run.clouds[-1], fluctuation(run)
    return (
        {name: found[name] for name in FIGURES}
        | {"fluctuation": most[0], "fluctuation_above": most[1]}
        | {"deposit": (end.x[:, 0] / run.length, end.mass)}
    )


def fluctuation(run: Run) -> np.ndarray:
    """The largest fluctuation energy of the frames, (3/2) m T [Ceccato2019, Eq. 11], over the
    potential energy at the start: of all points, and of those higher than a diameter.
    """
    shares = []
    for frame, cloud in enumerate(run.clouds):
        energy = 1.5 * energies(run, frame)
        high = cloud.x[:, 1] > run.case["grains.diameter"]
        shares.append((energy.sum(), energy[high].sum()))
    return np.max(shares, axis=0) / run.energy["potential"][0]


def distances(rows: list[dict]) -> list[dict]:
    """The rows with the distances of their deposits, NaN where there is none to compare with, and
    without the deposits.
    """
    deposits = {(row["law"], row["cells"], row["seed"]): row.get("deposit") for row in rows}

    def distance(row: dict, **other) -> float:
        at = row | other
        to = deposits.get((at["law"], at["cells"], at["seed"]))
        if to is None or "deposit" not in row:
            return math.nan
        (x, mass), (y, masses) = row["deposit"], to
        return float(wasserstein(x, y, mass, masses))

    out = []
    for row in rows:
        sizes = sorted(cells for law, cells, _ in deposits if law == row["law"])
        finer = [cells for cells in sizes if cells > row["cells"]]
        seeds = [seed for *_, seed in deposits if seed != row["seed"]]
        out.append(
            {name: value for name, value in row.items() if name != "deposit"}
            | {
                "to_next": distance(row, cells=finer[0]) if finer else math.nan,
                "to_finest": distance(row, cells=sizes[-1]) if finer else math.nan,
                "apart": distance(row, seed=seeds[0]) if seeds else math.nan,
            }
        )
    return out


def limits(table: pd.DataFrame) -> dict[str, bool]:
    """By law, whether the deposit comes to a limit as far as it was refined: whether the last
    refinement moves it less than the one before. Finer than what is resolved, each should move it
    half as far or less; one that moves it further has found another solution.
    """
    out = {}
    for law, part in table.groupby("law", sort=False):
        moved = part.groupby("cells")["to_next"].mean().dropna()
        out[str(law)] = bool(moved.iloc[-1] < moved.iloc[-2])
    return out


def main(words: list[str]) -> int:
    parser = command_line.Parser(prog="compare.study.refinement", description=__doc__)
    parser.add_argument("case", type=Path, metavar="CASE", help="folder that holds case.toml")
    parser.add_argument(
        "--cells", type=int, nargs="+", default=[10, 20, 40, 80], help="in the height (%(default)s)"
    )
    parser.add_argument("--laws", nargs="+", choices=LAWS, default=list(LAWS), help="all")
    parser.add_argument("--seeds", type=int, default=2, help="displaced starts (%(default)s)")
    options = parser.parse_args(words)
    if len(set(options.cells)) < 3:
        parser.error(f"--cells: {len(set(options.cells))} numbers (a limit takes three at least)")
    refuse_chute(load(options.case), "refinements are")
    target = options.case / "reference" / "refinement.csv"
    check_table(target)
    rows = []
    for law, cells, seed in product(options.laws, options.cells, range(1, options.seeds + 1)):
        rows.append(one(options.case, law, cells, seed))
        said = ("law", "cells", "seed", "status", "message", "centre")
        print({k: rows[-1][k] for k in said if k in rows[-1]}, file=sys.stderr, flush=True)
    table = distances(rows)
    command = typed("python3 -m compare.study.refinement", words)
    write_table(target, head(about(command), UNITS), table, "%.6g")
    redraw.draw(redraw.of_refinement, target.parent)
    for law, comes in limits(pd.DataFrame(table)).items():
        print(law, "comes to a limit" if comes else "finds another solution on finer cells")
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(sys.argv[1:])))
