"""What means over cells of pressure and volume change do: a deposit on coarse cells, and columns
that lock.
"""

import subprocess
from itertools import product
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


# With means over cells a coarse deposit reaches too far. Without, the one of 10 cells is three
# times as near to the one of fine cells, and both come to one deposit as cells shrink.
def test_without_means_coarse_deposits_are_nearer_to_fine_ones(tmp_path):
    height = 0.05
    found: dict[tuple[str, int], np.ndarray] = {}
    for averaging, cells in product(("none", "cell"), (10, 28)):
        collapse(
            tmp_path / "mpm.h5",
            "column_small",
            material__law="mu_i",
            mpm__cell_size=height / cells,
            mpm__volumetric_averaging=averaging,
        )
        found[averaging, cells] = deposit(tmp_path / "mpm.h5", height)

    def apart(one: tuple[str, int], other: tuple[str, int]) -> float:  # [L0]
        return float(np.mean(np.abs(found[one] - found[other])))

    own, means = apart(("none", 10), ("none", 28)), apart(("cell", 10), ("cell", 28))
    assert own < 0.015  # half of the margin of a comparison
    assert means > 2.0 * own  # the control
    assert apart(("none", 28), ("cell", 28)) < 0.5 * apart(("none", 10), ("cell", 10))


# A loose column contracts as it flows; where each point has to on its own, they carry the load by
# turns.
def test_loose_columns_lock_without_means(tmp_path):
    loose = {
        "material__law": "solid_fluid",
        "material__card": "dem_mu05",
        "initial__void_ratio": 0.8,
    }
    for averaging, locks in (("none", True), ("cell", False)):
        said = collapse(
            tmp_path / "mpm.h5", "column_ci", mpm__volumetric_averaging=averaging, **loose
        )
        assert ("locking" in said) == locks, averaging
