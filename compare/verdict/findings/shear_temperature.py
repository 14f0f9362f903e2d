"""A correlation length that the shear test of the grains contradicts."""

from dataclasses import fields

import numpy as np

from cases.programs import ROOT
from compare.element import records
from compare.element.blocks import by_point
from compare.element.case import Case
from compare.element.card import Card
from compare.element.model import Model
from compare.verdict.findings import Finding, Severity, check

LAWS = ("solid_fluid", "contact_share")  # whose steady shear the closed form knows
SHEAR = ROOT / "cases" / "shear"
BETWEEN = (0.55, 0.58)  # solid fractions: dense, and still below the critical one
# Mapped from a column, T/(gdot d)^2 itself grows by 1.4 (0.29 to 0.41) when the averaging width
# does from 0.75 to 1.5 d: up to there, a column could not tell the law's from the grains'.
FACTOR = 1.5
# Grains as those of the shear test, within what moves their effective restitution by 0.02.
SAME = {"friction": 0.05, "restitution": 0.02}


def ratio(card: Card, shear: Case) -> float:
    """T of the law over that of the grains, the geometric mean over solid fractions and rates."""
    points = by_point(records.measured(shear), ("solid_fraction", "shear_rate"))
    dense = {
        (nu, rate): seeds for (nu, rate), seeds in points.items() if BETWEEN[0] <= nu <= BETWEEN[1]
    }
    nu, rate = np.array(list(dense)).T
    measured = [
        np.mean([np.log(row["granular_temperature"]) for seed in seeds for row in seed])
        for seeds in dense.values()
    ]
    law = Model(card, shear.grains).shear(nu, rate)["granular_temperature"]
    return float(np.exp(np.mean(np.log(law) - measured)))


@check(order=86)
def shear_temperature(c, metrics):
    """Granular temperature of the law in steady simple shear, in closed form with the
    case's constants, over that of the grains in the element test cases/shear; only where the case
    has such grains, for which the correlation length is a choice that the test can judge.
    """
    if not c.mpm:
        return
    scene = c.mpm[0].case
    material = scene["material"]
    if material.get("law") not in LAWS or not material["collisions"]:
        return
    if material["effective_restitution"] == 1.0:  # no length dissipates: there is no steady state
        return
    shear = Case(SHEAR)
    grains = [(scene[f"grains.{key}"], getattr(shear.grains, key), SAME[key]) for key in SAME]
    if any(abs(own - tested) > apart for own, tested, apart in grains):
        return
    card = Card(**{one.name: material[one.name] for one in fields(Card)})
    share = ratio(card, shear)
    if not 1 / FACTOR <= share <= FACTOR:
        much = "too fast" if share < 1 else "too slowly"
        yield Finding(
            Severity.CAUTION,
            f"The law's granular temperature is {share:.2f} of the grains' in the shear test "
            f"(solid fractions {BETWEEN[0]} to {BETWEEN[1]}): its correlation length, "
            f"{card.correlation_length} × {card.correlation_factor:g}, lets fluctuations dissipate "
            f"{much}.",
            "The card dem_mu05 is fitted to that test; grainpair calibrate --correlation fits "
            "another choice.",
            share,
            FACTOR,
            reason="either way; below it the averaging width alone moves the figure as much in a "
            "column",
            of="mpm",
        )
