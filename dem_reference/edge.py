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


def edge(
    distance: np.ndarray,
    diameter: float,
    *,
    width: float | None = None,
    area: np.ndarray | None = None,
) -> float:
    """Where the deposit ends [m].

    Near side of the first strip, one diameter wide, with less than SHARE of a close-packed
    monolayer. Followed outwards, so that a few grains that came to rest together far ahead do not
    count. distance: of the grains (n,) [m], from the wall of a slab of `width` [m], or from the
    axis of a quarter of a cylinder when there is none. area: of each grain over that of one of
    `diameter` (n,), where they are not alike.
    """
    count = np.bincount((distance / diameter).astype(int), area)
    k = np.arange(count.size)
    strip = (
        np.full(count.size, width * diameter) if width else np.pi / 4 * diameter**2 * (2 * k + 1)
    )
    grain = np.sqrt(3) / 2 * diameter**2  # area of a grain in a close-packed layer
    thin = np.flatnonzero(count * grain < SHARE * strip)
    return float(thin[0] if thin.size else count.size) * diameter


def row(path: Path) -> dict[str, float]:
    """Aspect ratio, run-out by the edge of the deposit [L0], and what summary.py says."""
    with reading.result(path) as file:
        case = parse(reading.attributes(file)["case_resolved"], path)
        geometry = case.values["geometry"]
        cloud = reading.group(file, f"data/{file.attrs['steps']}/particles/cloud")
        grains = reading.values(cloud, "kind") == 1
        x, _, z = reading.vectors(cloud, "position", len(grains))[grains].T
        radius = reading.values(cloud, "radius", len(grains))[grains]
        d, area = 2 * float(radius[0]), None
        if case["grains.size_spread"]:
            d = case["grains.diameter"] * case["dem.coarsening"]
            area = (2 * radius / d) ** 2
    radial = geometry["dimension"] == "axisymmetric"
    front = (
        edge(np.hypot(x, z), d, area=area)
        if radial
        else edge(np.maximum(x, 0), d, width=geometry["thickness"], area=area)
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
