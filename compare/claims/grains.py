"""What the grains' side states about itself, measured on the smallest column and on single
collisions.
"""


import h5py
import numpy as np

from cases.case import load
from cases.scratch import temporary
from dem_reference.collision import COLUMNS, table
from dem_reference.grains import Grains
from dem_reference.run import main


def restitution_error() -> float:
    """Largest relative error of the normal restitution, head-on, at the seed's stiffness and step,
    0.01 to 1.4 m/s. [-]
    """
    case = load("cases/column").values
    rows = dict(
        zip(
            COLUMNS, table(case, Grains.of(case).young_modulus, case["dem"]["time_step_fraction"]).T
        )
    )
    asked = case["grains"]["restitution"]
    return float(np.abs(rows["restitution"][rows["angle"] == 0] / asked - 1).max())


def every_step_balance() -> float:
    """Largest share of the released energy that an audit of every step leaves open, to 1.5
    sqrt(H/g). [-]
    """
    with temporary() as folder:
        path = folder / "dem.h5"
        main(
            [
                "cases/column_ci",
                "-o",
                str(path),
                "--set",
                "dem.audit_interval=1",
                "--set",
                "time.maximum=1.5",
                "--quiet",
            ]
        )
        with h5py.File(path) as file:
            potential, open_ = file["energy/potential"][()], file["energy/unaccounted"][()]
    return float(np.abs(open_).max() / (potential[0] - potential[-1]))
