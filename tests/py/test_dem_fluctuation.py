"""Fluctuation energy: none in an affine motion, all of it in random motion."""

import numpy as np
import pytest

from dem_reference.grains import Grains
from dem_reference.moment import ARRAYS, atoms_of, fluctuation_energy

GRAINS = Grains(1.0, 1.0, 1e7, 0.3, 0.9, 0.5)


def energy(v, x, radial=False, radius=None):
    nothing = np.zeros(x.shape)
    values = {"x": x, "v": v, "id": np.arange(len(x)), "type": np.ones(len(x))}
    arrays = {
        name: np.ascontiguousarray(values.get(name, nothing), kind) for name, kind in ARRAYS.items()
    }
    if radius is not None:
        arrays["radius"] = radius
    return fluctuation_energy(atoms_of(arrays), GRAINS, radial)


def test_an_affine_motion_has_none():
    x = np.random.default_rng(1).uniform(0, 12, (600, 3))
    v = np.array([1.0, 2.0, 3.0]) + x[:, :2] @ np.array([[0.3, -2.0, 0.1], [5.0, -0.3, 0.2]])
    kinetic = GRAINS.mass / 2 * (v * v).sum()
    assert energy(v, x) < 1e-24 * kinetic + 1e-26 * kinetic * len(x)


def test_random_motion_on_an_affine_one_is_found_without_bias():
    """3/2 N m T, within three standard errors of a sum of 3 N squares."""
    random, temperature, n = np.random.default_rng(2), 0.25, 20000
    x = random.uniform(0, 60, (n, 3)) * [1, 0.5, 0.05]
    v = random.normal(0, np.sqrt(temperature), (n, 3)) + x[:, :2] @ np.array(
        [[0.3, -2.0, 0.1], [5.0, -0.3, 0.2]]
    )
    expected = 1.5 * n * GRAINS.mass * temperature
    assert energy(v, x) == pytest.approx(expected, rel=3 * np.sqrt(2 / (3 * n)))


def test_lone_grains_have_none():
    x = np.arange(30).reshape(10, 3) * 40.0
    assert energy(np.ones((10, 3)), x) == 0.0


def test_rigid_rotation_about_the_axis_has_none_in_rings():
    """Its tangential speed grows with the distance, whatever the direction."""
    x = np.random.default_rng(3).uniform(-12, 12, (3000, 3))
    v = np.cross([0.0, 2.0, 0.0], x)
    kinetic = GRAINS.mass / 2 * (v * v).sum()
    assert energy(v, x, radial=True) < 1e-24 * kinetic * len(x)
    random = v + np.random.default_rng(4).normal(0, 0.1, v.shape)
    expected = 1.5 * len(x) * GRAINS.mass * 0.1**2
    assert energy(random, x, radial=True) == pytest.approx(
        expected, rel=3 * np.sqrt(2 / (3 * len(x)))
    )


def test_of_grains_of_several_sizes_each_counts_by_its_mass():
    """Random motion on an affine one, of two sizes: 3/2 T sum m, and none without it."""
    random, n, temperature = np.random.default_rng(5), 20000, 0.25
    x = random.uniform(0, 60, (n, 3)) * [1, 0.5, 0.05]
    affine = x[:, :2] @ np.array([[0.3, -2.0, 0.1], [5.0, -0.3, 0.2]])
    radius = random.choice([0.4, 0.6], n)
    mass = GRAINS.density * 4 / 3 * np.pi * radius**3
    kinetic = (mass @ (affine**2).sum(axis=1)) / 2
    assert energy(affine, x, radius=radius) < 1e-20 * kinetic
    v = affine + random.normal(0, np.sqrt(temperature), (n, 3))
    # three standard errors of a sum of squares with the weights m
    error = 3 * np.sqrt(2 * (mass**2).sum() / (3 * mass.sum() ** 2))
    assert energy(v, x, radius=radius) == pytest.approx(1.5 * temperature * mass.sum(), rel=error)
    alike = 1.5 * temperature * n * GRAINS.mass
    assert energy(v, x, radius=radius) != pytest.approx(alike, rel=error)
