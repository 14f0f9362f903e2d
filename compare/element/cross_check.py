"""The two DEM engines against each other.

LIGGGHTS between bumpy walls and LAMMPS in homogeneous shear.
"""

import numpy as np
from scipy.interpolate import PchipInterpolator

from compare.element.blocks import by_point
from compare.element.records import Rows


def deviations(walls: Rows, homogeneous: Rows, density: float) -> list[dict]:
    """For each run between walls, its p/(rho_s T) and s/p over those of homogeneous shear, less 1.

    At the core's solid fraction: the homogeneous values are interpolated over it (monotone cubic,
    in the logarithm) at the shear rate nearest to the core's. `density` of a grain [kg/m3].
    """
    deviations = []
    for wall in walls:
        rates = {row["shear_rate"] for row in homogeneous}
        rate = min(rates, key=lambda r: abs(np.log(r / wall["core_shear_rate"])))
        nearest = [row for row in homogeneous if row["shear_rate"] == rate]
        points = by_point(nearest, ("solid_fraction",))
        nu = [fraction for (fraction,) in points]

        def expected(view):
            values = [
                np.mean([np.log(view(seed[0])) for seed in seeds]) for seeds in points.values()
            ]
            return np.exp(
                PchipInterpolator(nu, values, extrapolate=False)(wall["core_solid_fraction"])
            )

        views = {
            "pressure over temperature": lambda row: row["pressure"]
            / (density * row["granular_temperature"]),
            "stress ratio": lambda row: row["shear_stress"] / row["pressure"],
        }
        deviations.append(
            {"core_solid_fraction": wall["core_solid_fraction"], "shear_rate": rate}
            | {name: float(view(wall) / expected(view) - 1) for name, view in views.items()}
        )
    return deviations


def sentences(walls: Rows, homogeneous: Rows, density: float) -> list[str]:
    return [
        "cross-check, LIGGGHTS between bumpy walls against LAMMPS in homogeneous shear, at nu "
        f"{d['core_solid_fraction']:.3f}: p/(rho T) {d['pressure over temperature']:+.1%}, "
        f"s/p {d['stress ratio']:+.1%}."
        for d in deviations(walls, homogeneous, density)
    ]
