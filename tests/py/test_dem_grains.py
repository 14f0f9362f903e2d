"""Time scales of grains, and the refusal of steps that would not resolve a contact."""

import pytest

from cases.errors import CaseError, Failure
from dem_reference.grains import Grains, time_step


def seed_grains(young_modulus=3e8):
    return Grains(2e-3, 2532, young_modulus, 0.3, 0.879, 0.5)


@pytest.mark.parametrize(
    "young_modulus, rayleigh, contact",
    [(3e8, 1.59e-5, 83e-6), (3e7, 5.03e-5, 209e-6), (5e6, 1.23e-4, 429e-6)],
)
def test_time_scales_are_those_liggghts_prints(young_modulus, rayleigh, contact):
    """Figures of fix check/timestep/gran for these grains, three digits."""
    grains = seed_grains(young_modulus)
    assert grains.rayleigh_time() == pytest.approx(rayleigh, rel=5e-3)
    assert grains.contact_time(0.1) == pytest.approx(contact, rel=5e-3)


def test_contact_time_solves_the_hertz_collision():
    """m* x'' = -k x^(3/2) integrated from touch to parting takes the closed form's time.

    Its constant 2.87 has three digits.
    """
    grains, speed = seed_grains(), 0.3
    k, m = 4 / 3 * grains.contact_modulus * (grains.radius / 2) ** 0.5, grains.mass / 2
    dt, x, v, t = grains.contact_time(speed) / 20000, 0.0, speed, 0.0
    while x >= 0:
        v -= dt * k * max(x, 0) ** 1.5 / m
        x += dt * v
        t += dt
    assert grains.contact_time(speed) == pytest.approx(t, rel=5e-3)


def test_a_step_within_the_limits_is_taken():
    assert time_step(seed_grains(), 0.19, 0.1, 9.81) == pytest.approx(0.19 * 1.59e-5, rel=5e-3)


def test_a_step_above_the_rayleigh_limit_is_refused():
    with pytest.raises(CaseError, match="time_step_fraction: 0.3 of the Rayleigh time"):
        time_step(seed_grains(), 0.3, 0.1, 9.81)


def test_a_step_that_an_impact_outruns_is_refused_with_one_that_does_not():
    with pytest.raises(CaseError, match="hits for .* steps only") as refusal:
        time_step(seed_grains(5e6), 0.25, 10.0, 9.81)
    assert refusal.value.code is Failure.REFUSED
    offered = float(str(refusal.value).removesuffix(" [refused]").split()[-1])
    assert time_step(seed_grains(5e6), offered, 10.0, 9.81) > 0


def test_coarser_and_softer_grains_follow_the_case():
    case = {
        "grains": {
            "diameter": 2e-3,
            "density": 2532.0,
            "young_modulus": 3e8,
            "poisson_ratio": 0.3,
            "restitution": 0.879,
            "friction": 0.5,
        },
        "dem": {"coarsening": 2.0, "young_modulus": 3e7},
    }
    grains = Grains.of(case)
    assert (grains.diameter, grains.young_modulus) == (4e-3, 3e7)
