"""Two real grains collide in LIGGGHTS: restitution and energy."""

import numpy as np
import pytest

from cases.case import load
from dem_reference.collision import COLUMNS, table
from dem_reference.grains import LEAST_STEPS_PER_CONTACT

ASKED = 0.879


@pytest.fixture(
    scope="module",
    params=[(3e8, 0.19), (5e6, 0.25)],
    ids=["seed stiffness", "softest and longest step"],
)
def pairs(request):
    rows = table(load("cases/column").values, *request.param)
    allowed = (
        rows[:, COLUMNS.index("steps")] >= LEAST_STEPS_PER_CONTACT
    )  # a run that resolves its impacts less is refused
    assert allowed.sum() >= 9
    return dict(zip(COLUMNS, rows[allowed].T))


def test_normal_restitution_is_the_one_asked_for(pairs):
    """One per cent at ten steps per contact, as grains.py says.

    Its error falls with the step from there.
    """
    head_on = pairs["angle"] == 0
    assert pairs["restitution"][head_on] == pytest.approx(ASKED, rel=1e-2)


def test_slow_oblique_collisions_have_it_too(pairs):
    """A fast one turns its line of centres while it lasts, and centrifugal force takes part.

    A slow one does not.
    """
    slow = pairs["speed"] <= 0.01
    assert pairs["restitution"][slow] == pytest.approx(ASKED, rel=1e-2)


def test_work_on_the_contact_is_the_kinetic_energy_lost(pairs):
    assert np.abs(pairs["work_residual"]).max() < 1e-12


def test_sampled_powers_find_the_same_loss_head_on(pairs):
    """Normal damping alone.

    5e-3 of the energy is what ten steps per contact leave of the time integral.
    """
    head_on = pairs["angle"] == 0
    assert np.abs(pairs["power_residual"][head_on]).max() < 5e-3


def test_sliding_grains_keep_their_sense_and_gripping_ones_recoil(pairs):
    """At 60 degrees friction grips and reverses the slip only if it must.

    Both signs occur, none gains.
    """
    assert np.all(np.abs(pairs["tangential_restitution"]) <= 1)
    assert np.all(pairs["loss"] > 1 - ASKED**2 - 0.02)


def test_shorter_steps_close_the_power_balance():
    """The residual of oblique collisions comes from the step.

    A quarter of the step leaves at most half of it.
    """
    case = load("cases/column").values
    residual = COLUMNS.index("power_residual")
    coarse, fine = (
        np.abs(table(case, 3e8, fraction)[:, residual]).mean() for fraction in (0.2, 0.05)
    )
    assert fine < coarse / 2
