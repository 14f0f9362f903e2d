"""How far the law's closed forms are from the grains in the element tests: median errors over a
test's points, relative; of void ratios, absolute.
"""

from functools import cache

import numpy as np

from compare.element import calibration
from compare.commands.claims import ROOT
from compare.element.case import Case
from compare.element.deviations import table
from compare.element.card import Card
from compare.element.model import Model
from compare.verdict.findings import shear_temperature


@cache
def median_errors() -> dict[tuple[str, str], float]:
    """By quantity ("shear pressure") and card."""
    blocks, grains = calibration.evidence(ROOT / "cases")
    rows = table(
        blocks, {name: Model(Card.read(name), grains) for name in ("seed_table1", "dem_mu05")}
    )
    keys = dict.fromkeys((row["quantity"], row["card"]) for row in rows)
    return {
        key: float(
            np.median([abs(row["error"]) for row in rows if (row["quantity"], row["card"]) == key])
        )
        for key in keys
    }


def _temperature(card: str, **values):
    """Granular temperature in dense steady shear over the grains', of a card with other values."""
    return lambda: shear_temperature.ratio(
        Card.read(card).with_values(**values), Case(shear_temperature.SHEAR)
    )


def _of(quantity: str, card: str):
    return lambda: median_errors()[quantity, card]


shear_granular_temperature_table1 = _of("shear granular_temperature", "seed_table1")
shear_granular_temperature_calibrated = _of("shear granular_temperature", "dem_mu05")
shear_pressure_table1 = _of("shear pressure", "seed_table1")
shear_pressure_calibrated = _of("shear pressure", "dem_mu05")
shear_shear_stress_table1 = _of("shear shear_stress", "seed_table1")
shear_shear_stress_calibrated = _of("shear shear_stress", "dem_mu05")
cooling_rate_table1 = _of("cooling rate", "seed_table1")
cooling_rate_calibrated = _of("cooling rate", "dem_mu05")
triaxial_stress_ratio_table1 = _of("triaxial stress ratio", "seed_table1")
triaxial_stress_ratio_calibrated = _of("triaxial stress ratio", "dem_mu05")
triaxial_void_ratio_table1 = _of("triaxial void ratio", "seed_table1")
triaxial_void_ratio_calibrated = _of("triaxial void ratio", "dem_mu05")
isotropic_bulk_modulus_table1 = _of("isotropic bulk_modulus", "seed_table1")
isotropic_bulk_modulus_calibrated = _of("isotropic bulk_modulus", "dem_mu05")
isotropic_shear_modulus_table1 = _of("isotropic shear_modulus", "seed_table1")
isotropic_shear_modulus_calibrated = _of("isotropic shear_modulus", "dem_mu05")
temperature_table1 = _temperature("seed_table1")
temperature_calibrated = _temperature("dem_mu05")
temperature_jenkins = _temperature("seed_table1", correlation_length="jenkins")
temperature_none = _temperature("seed_table1", correlation_length="none")
