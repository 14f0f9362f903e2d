"""Fluctuation energy: none in an affine motion, all of it in random motion."""

from types import SimpleNamespace

import numpy as np
import pytest

from dem_reference.fluctuation import fluctuation_energy
from dem_reference.grains import Grains

GRAINS = Grains(1.0, 1.0, 1e7, 0.3, 0.9, 0.5)


def cloud(v, x):
    return SimpleNamespace(
        grains=GRAINS, mobile=np.ones(len(x), bool), atoms={"x": x, "v": v}, radial=False
    )


def test_an_affine_motion_has_none():
    x = np.random.default_rng(1).uniform(0, 12, (600, 3))
    v = np.array([1.0, 2.0, 3.0]) + x[:, :2] @ np.array([[0.3, -2.0, 0.1], [5.0, -0.3, 0.2]])
    kinetic = GRAINS.mass / 2 * (v * v).sum()
    assert fluctuation_energy(cloud(v, x)) < 1e-24 * kinetic + 1e-26 * kinetic * len(x)


def test_random_motion_on_an_affine_one_is_found_without_bias():
    """3/2 N m T, within three standard errors of a sum of 3 N squares."""
    random, temperature, n = np.random.default_rng(2), 0.25, 20000
    x = random.uniform(0, 60, (n, 3)) * [1, 0.5, 0.05]
    v = random.normal(0, np.sqrt(temperature), (n, 3)) + x[:, :2] @ np.array(
        [[0.3, -2.0, 0.1], [5.0, -0.3, 0.2]]
    )
    expected = 1.5 * n * GRAINS.mass * temperature
    assert fluctuation_energy(cloud(v, x)) == pytest.approx(expected, rel=3 * np.sqrt(2 / (3 * n)))


def test_lone_grains_have_none():
    x = np.arange(30).reshape(10, 3) * 40.0
    assert fluctuation_energy(cloud(np.ones((10, 3)), x)) == 0.0
