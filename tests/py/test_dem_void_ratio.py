"""Void ratios come from exact volumes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dem_reference.void_ratio import clipped_volume, void_ratio

SPHERE = 4 / 3 * np.pi
place = st.floats(-1.5, 1.5)


@given(place, place, st.floats(-1.4, 1.4), st.floats(-1.4, 1.4))
def test_the_four_quarters_of_a_cut_sphere_add_up(x, y, a, b):
    """Two planes anywhere cut a sphere into four parts.

    24 Gauss points leave 1e-4 of a sphere at the worst (sqrt ends).
    """
    centre, far = np.array([[x, y]]), 10.0
    parts = [
        clipped_volume(centre, 1.0, np.array(lower), np.array(upper))[0]
        for lower, upper in (
            ((-far, -far), (a, b)),
            ((a, -far), (far, b)),
            ((-far, b), (a, far)),
            ((a, b), (far, far)),
        )
    ]
    assert sum(parts) == pytest.approx(SPHERE, rel=1e-4)
    assert min(parts) >= -1e-12


def test_a_corner_cut_agrees_with_counting_points():
    random = np.random.default_rng(1)
    points = random.uniform(-1, 1, (400_000, 3))
    lower, upper = np.array([-0.3, -5.0]), np.array([5.0, 0.2])
    inside = ((points**2).sum(axis=1) < 1) & (points[:, 0] > lower[0]) & (points[:, 1] < upper[1])
    exact = clipped_volume(np.zeros((1, 2)), 1.0, lower, upper)[0]
    sigma = 8 * np.sqrt(inside.mean() * (1 - inside.mean()) / len(points))
    assert exact == pytest.approx(8 * inside.mean(), abs=4 * sigma)


def test_a_cubic_lattice_has_its_void_ratio_in_any_whole_box():
    grid = np.arange(-2, 12) + 0.5
    centres = np.stack(np.meshgrid(grid, grid, [0.5], indexing="ij"), axis=-1).reshape(-1, 3)
    for shift in (0.0, 0.37):  # the box's faces cut spheres, edges cut them twice
        e = void_ratio(centres, 0.5, (1 + shift, 1 + shift), (8 + shift, 6 + shift), 1.0)
        assert e == pytest.approx(6 / np.pi - 1, rel=1e-5)
