"""What the continuum's solver states about itself, measured on the smallest column."""

import h5py
import numpy as np

from cases.programs import own
from compare.commands.claims import metrics


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
