"""Run-out of axisymmetric columns, by the definition of the published figures they are compared with.

    python3 -m dem_reference.axisymmetric DEM.h5... [-o TABLE.csv]
"""

import argparse
import sys
from pathlib import Path

import h5py
import numpy as np
import pandas as pd

from compare.case import parse

from .ensemble import save
from .summary import scalars

SHARE = 0.3  # of a monolayer, that the outermost annulus must hold
KEPT = ("seed", "run_out", "run_out_99", "height_at_wall", "kinetic_energy_peak", "kinetic_energy_peak_time", "dissipated_short",
        "dissipated_enduring", "unaccounted", "void_ratio", "grains", "kinetic_energy_end")


def edge(r: np.ndarray, diameter: float, angle: float = np.pi / 2) -> float:
    """Outer radius [m] of the outermost annulus, one diameter wide, in which grains cover SHARE of a close-packed monolayer.

    r: distances from the axis (n,) [m] of the grains in a sector of `angle` [rad].
    """
    count = np.bincount((r / diameter).astype(int))
    k = np.arange(count.size)
    area = angle / 2 * diameter**2 * ((k + 1) ** 2 - k**2)
    grain = np.sqrt(3) / 2 * diameter**2  # area of a grain in a close-packed layer
    full = np.flatnonzero(count * grain >= SHARE * area)
    return float((full[-1] + 1) * diameter) if full.size else 0.0


def row(path: Path) -> dict[str, float]:
    """Aspect ratio, run-out by the edge of the deposit [R0], and what summary.py says of the run."""
    with h5py.File(path) as file:
        geometry = parse(file.attrs["case_resolved"]).values["geometry"]
        cloud = file[f"data/{file.attrs['steps']}/particles/cloud"]
        grains = cloud["kind"][()] == 1
        r = np.hypot(cloud["position/x"][()][grains], cloud["position/z"][()][grains])
        d = 2 * float(cloud["radius"][0])
    found = scalars(path)
    return {"aspect_ratio": geometry["height"] / geometry["length"], "run_out_edge": edge(r, d) / geometry["length"] - 1,
            **{name: found[name] for name in KEPT}}


def main() -> int:
    parser = argparse.ArgumentParser(prog="dem_reference.axisymmetric", description=__doc__.split("\n")[0])
    parser.add_argument("runs", nargs="+", type=Path, metavar="DEM.h5")
    parser.add_argument("-o", "--output", type=Path, help="table (CSV) with a row per run")
    options = parser.parse_args()
    table = pd.DataFrame([row(path) for path in options.runs]).sort_values(["aspect_ratio", "seed"])
    if options.output:
        save(table, options.output, " ".join(["python3 -m dem_reference.axisymmetric", *sys.argv[1:]]),
             "run-outs in R0: edge of the deposit, 99.5 % and 99 % of mass; other units as in an ensemble's table")
    print(table.to_string(index=False, float_format=lambda value: f"{value:.4g}"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
