"""Calibration finds the constants that made the data, and a wrong card does not pass for them."""

from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from compare.element import calibration
from compare.element.calibration import names
from cases.programs import ROOT
from compare.element.card import Card
from compare.element.model import Model

SEED = Card.read("seed_table1")
TRUTH: dict[str, Any] = {
    "critical_void_ratio": 0.720,
    "critical_state_slope": 0.30,
    "critical_state_form": "two_thirds",
    "stress_ratio": 0.80,
    "bulk_stiffness": 90.0,
    "shear_stiffness": 60.0,
    "stiffness_exponent": 0.40,
    "dilatancy": 0.25,
    "effective_restitution": 0.65,
    "collision_time_factor": 3.0,
    "correlation_factor": 2.0,
}


@pytest.fixture(scope="module")
def real():
    return calibration.evidence(ROOT / "cases", card=SEED)


@pytest.fixture(scope="module")
def made(real):
    """The reference's own points and errors, answered by a known card with Gaussian noise."""
    blocks, grains = real
    card = Card.read("seed_table1").with_values(**TRUTH)
    return calibration.synthetic(blocks, Model(card, grains), seed=1), grains, card


@pytest.fixture(scope="module")
def fitted(made):
    blocks, grains, _ = made
    return calibration.fit(blocks, grains, Card.read("seed_table1"))


def test_known_constants_are_recovered(fitted):
    """Each within 4 of its own standard errors, and those are small enough to mean something."""
    assert fitted.card.critical_state_form == "two_thirds"
    for name in names(SEED):
        assert abs(getattr(fitted.card, name) - TRUTH[name]) < 4 * fitted.standard_error[name], name
        assert fitted.standard_error[name] < 0.25 * TRUTH[name], name
    assert not fitted.at_bound


def test_the_right_card_fits_and_wrong_ones_are_refused(made, fitted):
    """chi-square of noise drawn with the assumed sigma.

    The truth and the fit pass at 1e-4, another card fails by far. A single constant 6 of its
    standard errors off is told from the truth by 4 standard deviations (16 in chi-square).
    """
    blocks, grains, truth = made

    def distance(card):
        return float(np.sum(calibration.residuals(blocks, Model(card, grains)) ** 2))

    limit = chi2.ppf(1 - 1e-4, fitted.observations)
    assert distance(truth) < limit
    assert distance(fitted.card) < limit
    assert distance(Card.read("seed_table1")) > 10 * limit
    for name in names(SEED):
        off = TRUTH[name] + 6 * fitted.standard_error[name]
        assert distance(truth.with_values(**{name: off})) - distance(truth) > 16, name


def test_the_answer_does_not_depend_on_the_start(made, fitted):
    blocks, grains, truth = made
    other = calibration.minimise(
        blocks,
        grains,
        truth.with_values(stress_ratio=1.1, effective_restitution=0.5, bulk_stiffness=300.0),
    )
    card = calibration.to_card(other.x, truth)
    for name in names(SEED):
        assert getattr(card, name) == pytest.approx(getattr(fitted.card, name), rel=1e-2), name


def test_the_real_grains_are_not_table_1(real):
    """Table 1's packing is several times stiffer than that of the grains, at every pressure."""
    blocks, grains = real
    stiffness = [block for block in blocks if block.kind == "isotropic bulk_modulus"]
    residual = calibration.residuals(stiffness, Model(Card.read("seed_table1"), grains))
    assert residual.min() > 10


def test_the_constants_of_a_contact_share_are_recovered(real):
    """Those that the law has beside the seed's, from start and reversal of shear too.

    Within 4 of their standard errors, by Gauss-Newton's covariance, from a start 30 % off.
    """
    _, grains = real
    law = {"law": "contact_share", "correlation_length": "softened", "fabric_strain": 0.16}
    ours = {"correlation_onset": 8.0, "contact_share": 0.16}
    truth = SEED.with_values(**(TRUTH | law | ours))
    evidence, _ = calibration.evidence(ROOT / "cases", card=truth)
    blocks = calibration.synthetic(evidence, Model(truth, grains), seed=2)
    start = truth.with_values(correlation_onset=10.4, contact_share=0.11, fabric_strain=0.21)
    found = calibration.minimise(blocks, grains, start)
    card = calibration.to_card(found.x, start)
    error = dict(zip(names(card), np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)))))
    assert np.log(card.correlation_onset / 8.0) == pytest.approx(
        0, abs=4 * error["correlation_onset"]
    )
    assert card.contact_share == pytest.approx(0.16, abs=4 * error["contact_share"])
    assert np.log(card.fabric_strain / 0.16) == pytest.approx(0, abs=4 * error["fabric_strain"])
    # errors small enough to mean something: the start is told from the truth
    assert 4 * max(error["correlation_onset"], error["fabric_strain"]) < np.log(1.3)


def test_a_law_without_memory_is_not_fitted_to_a_reversal():
    """Its constants would be bent by what it cannot follow."""
    kinds = {
        card.fabric_strain: {b.kind for b in calibration.evidence(ROOT / "cases", card=card)[0]}
        for card in (SEED, SEED.with_values(law="contact_share", fabric_strain=0.2))
    }
    assert {"turned pressure", "started pressure"} < kinds[0.2] - kinds[0.0]
    assert kinds[0.0] < kinds[0.2]
