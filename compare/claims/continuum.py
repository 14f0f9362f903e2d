"""What the continuum's solver states about itself, measured on the smallest column."""

import tempfile
from pathlib import Path

import h5py
import numpy as np

from cases.programs import ROOT, own, program
from cases.stages import Stage, run_stages
from compare.commands.claims import metrics

SCENES = ("column", "column_ci", "column_shallow", "column_small", "column_tall", "cylinder")


def ledger_drift() -> float:
    """Largest change of the sum of all energy accounts over a run, over the energy released. [-]"""
    metrics("column_ci")
    with h5py.File(own("runs", "claims", "column_ci") / "mpm.h5") as file:
        energy = {name: column[()] for name, column in file["energy"].items()}
    total = sum(
        energy[name]
        for name in ("kinetic", "potential", "elastic", "fluctuation", "dissipated", "unaccounted")
    )
    return float(np.ptp(total) / (energy["potential"][0] - energy["potential"][-1]))


def worst_loss() -> float:
    """The largest numerical loss of the shipped scenes, over the energy each releases. [-]"""
    losses = []
    with tempfile.TemporaryDirectory(prefix="grainpair-") as folder:
        for name in SCENES:
            result = Path(folder) / f"{name}.h5"
            run_stages(
                [Stage(name, [program("mpm_run"), ROOT / "cases" / name, "-o", result])], quiet=True
            )
            with h5py.File(result) as file:
                potential, lost = (file["energy"][key][()] for key in ("potential", "unaccounted"))
            losses.append(abs(lost[-1]) / (potential[0] - potential[-1]))
    return float(max(losses))
