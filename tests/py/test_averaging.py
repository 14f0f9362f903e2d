"""What the share of cell means in pressure and volume change does: a deposit on coarse cells, and
columns that lock.
"""

import subprocess
from pathlib import Path

import h5py
import numpy as np

from cases.programs import ROOT, program

MASS = np.linspace(0.0005, 0.9995, 1000)


def collapse(result: Path, case: str, **keys) -> str:
    """Runs a case with its keys set, SECTION__KEY for SECTION.KEY; what is said."""
    words = [f"--set={key.replace('__', '.')}={value}" for key, value in keys.items()]
    done = subprocess.run(
        [program("mpm_run"), ROOT / "cases" / case, "-o", result, "--quiet", *words],
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stderr


def deposit(result: Path, height: float) -> np.ndarray:
    """Places along x of the points, by their share of the mass, over the height of the column."""
    with h5py.File(result) as run:
        cloud = run["data"][max(run["data"], key=int)]["particles/cloud"]
        x, mass = cloud["position/x"][:], cloud["mass"][:]
    order = np.argsort(x)
    return np.interp(MASS, np.cumsum(mass[order]) / mass.sum(), x[order]) / height


# Points of a cell that share all of their pressure do not resist what they do against each other,
# and a coarse deposit reaches too far: with half of it their own it is four times as near to that
# of fine cells.
def test_half_of_the_means_brings_coarse_deposits_nearer(tmp_path):
    height = 0.05

    def distance(share: float) -> float:
        found = []
        for cells in (10, 28):
            collapse(
                tmp_path / "mpm.h5",
                "column_small",
                material__law="mu_i",
                mpm__cell_size=height / cells,
                mpm__volume_relaxation=1,
                mpm__volumetric_averaging=share,
            )
            found.append(deposit(tmp_path / "mpm.h5", height))
        return np.mean(np.abs(found[0] - found[1]))

    half, all_of_it = distance(0.5), distance(1.0)
    assert half < 0.02  # L0; the margin of a comparison is 0.03
    assert all_of_it > 2.0 * half  # the control


# A loose column contracts as it flows; where each point has to on its own, they carry the load by
# turns.
def test_loose_columns_lock_without_means(tmp_path):
    loose = {
        "material__law": "solid_fluid",
        "material__card": "dem_mu05",
        "initial__void_ratio": 0.8,
    }
    for share, locks in ((0.0, True), (0.5, False), (1.0, False)):
        said = collapse(tmp_path / "mpm.h5", "column_ci", mpm__volumetric_averaging=share, **loose)
        assert ("locking" in said) == locks, share
