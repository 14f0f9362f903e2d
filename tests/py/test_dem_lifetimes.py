"""The split of dissipation by contact lifetime, on contacts whose history is known."""

import numpy as np
import pytest

from dem_reference.lifetimes import EDGES, Lifetimes


def sample(lifetimes, contacts):
    """contacts: {(first, second): (normal, tangential) heat}."""
    first, second = (np.array([pair[k] for pair in contacts], dtype=np.int64) for k in (0, 1))
    heat = np.array(list(contacts.values()), float).reshape(-1, 2)
    lifetimes.add(first, second, heat, np.zeros_like(heat))


def test_short_and_enduring_contacts_are_told_apart():
    lifetimes = Lifetimes(interval=1.0, unit=1.0, threshold=2.0)
    lifetimes.begin(
        np.array([9]), np.array([8]), np.zeros((1, 2))
    )  # stands at the release: enduring
    for k in range(5):
        contacts = {(8, 9): (0.0, 1.0), (1, 2): (1.0, 0.0)} | (
            {(3, 4): (10.0, 0.0)} if k < 2 else {}
        )
        sample(lifetimes, contacts)
    # 8-9 gave 5 from the first sample on; 1-2 is five units old and gave 5; 3-4 lasted two and
    # stays short
    assert lifetimes.enduring()[1] == pytest.approx(10.0)
    lifetimes.finish()
    assert lifetimes.heat_by_lifetime.sum() == pytest.approx(30.0)
    assert lifetimes.heat_by_lifetime[np.searchsorted(EDGES, 2.0)].tolist() == [20.0, 0.0]
    assert lifetimes.count_by_lifetime.sum() == 3


def test_a_pair_is_the_same_pair_in_either_order():
    lifetimes = Lifetimes(1.0, 1.0, 2.0)
    for pair in ((1, 2), (2, 1), (1, 2)):
        sample(lifetimes, {pair: (1.0, 0.0)})
    assert lifetimes.enduring()[1] == pytest.approx(3.0)


def test_a_contact_that_parts_and_meets_again_is_young_again():
    lifetimes = Lifetimes(1.0, 1.0, 2.0)
    for contacts in (
        {(1, 2): (1.0, 0.0)},
        {(1, 2): (1.0, 0.0)},
        {(3, 4): (0.0, 0.0)},
        {(1, 2): (1.0, 0.0)},
    ):
        sample(lifetimes, contacts)
    assert lifetimes.enduring()[1] == 0


def test_elastic_energy_held_is_not_dissipation():
    """Work goes in while a contact is squeezed and comes back when it ends.

    Nothing is left of an elastic contact.
    """
    lifetimes = Lifetimes(1.0, 1.0, 0.5)
    pair = np.array([1]), np.array([2])
    for work, held in ((2.0, 2.0), (1.0, 3.0), (-3.0, 0.0)):
        lifetimes.add(*pair, np.array([[work, 0.0]]), np.array([[held, 0.0]]))
        assert lifetimes.enduring()[1] == pytest.approx(0.0)
    lifetimes.finish()
    assert lifetimes.heat_by_lifetime.sum() == pytest.approx(0.0)
