"""Run-out by the edge of the deposit, as published: single grains ahead of it do not count.

    python3 -m dem_reference.edge DEM.h5... [-o TABLE.csv]
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd

from cases import command_line, reading
from cases.case import parse
from cases.errors import exit_code
from cases.files import check_table
from cases.provenance import typed

from .ensemble import save
from .summary import scalars

SHARE = 0.3  # of a monolayer, that a strip of the deposit must hold
KEPT = (
    "seed",
    "run_out",
    "run_out_99",
    "highest_grain_at_wall",
    "kinetic_energy_peak",
    "kinetic_energy_peak_time",
    "dissipated_short",
    "dissipated_enduring",
    "unaccounted",
    "void_ratio",
    "grains",
    "kinetic_energy_end",
)


def edge(distance: np.ndarray, diameter: float, *, width: float | None = None) -> float:
    """Where the deposit ends [m].

    Near side of the first strip, one diameter wide, with less than SHARE of a close-packed
    monolayer. Followed outwards, so that a few grains that came to rest together far ahead do not
    count. distance: of the grains (n,) [m], from the wall of a slab of `width` [m], or from the
    axis of a quarter of a cylinder when there is none.
    """
    count = np.bincount((distance / diameter).astype(int))
    k = np.arange(count.size)
    area = (
        np.full(count.size, width * diameter) if width else np.pi / 4 * diameter**2 * (2 * k + 1)
    )
    grain = np.sqrt(3) / 2 * diameter**2  # area of a grain in a close-packed layer
    thin = np.flatnonzero(count * grain < SHARE * area)
    return float(thin[0] if thin.size else count.size) * diameter


def row(path: Path) -> dict[str, float]:
    """Aspect ratio, run-out by the edge of the deposit [L0], and what summary.py says."""
    with reading.result(path) as file:
        geometry = parse(reading.attributes(file)["case_resolved"], path).values["geometry"]
        cloud = reading.group(file, f"data/{file.attrs['steps']}/particles/cloud")
        grains = reading.values(cloud, "kind") == 1
        x, _, z = reading.vectors(cloud, "position", len(grains))[grains].T
        d = 2 * float(reading.values(cloud, "radius", len(grains))[0])
    radial = geometry["dimension"] == "axisymmetric"
    front = (
        edge(np.hypot(x, z), d)
        if radial
        else edge(np.maximum(x, 0), d, width=geometry["thickness"])
    )
    found = scalars(path)
    return {
        "aspect_ratio": geometry["height"] / geometry["length"],
        "run_out_edge": front / geometry["length"] - 1,
        **{name: found[name] for name in KEPT},
    }


def main() -> int:
    parser = command_line.Parser(prog="dem_reference.edge", description=__doc__.split("\n")[0])
    parser.add_argument("runs", nargs="+", type=Path, metavar="DEM.h5")
    parser.add_argument("-o", "--output", type=Path, help="table (CSV) with a row per run")
    options = parser.parse_args()
    if options.output:
        check_table(options.output)
    table = pd.DataFrame([row(path) for path in options.runs]).sort_values(["aspect_ratio", "seed"])
    if options.output:
        save(
            table,
            options.output,
            typed("python3 -m dem_reference.edge", sys.argv[1:]),
            "run-outs in L0 (R0): edge of the deposit, 99.5 % and 99 % of mass; other units as in "
            "an ensemble's table",
        )
    print(table.to_string(index=False, float_format=lambda value: f"{value:.4g}"))
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(main))
