"""What a report computes without SciPy, against SciPy's."""

import numpy as np
import pytest
from scipy import integrate, ndimage, stats

from cases import student
from compare.mapping.reductions import integral, regions, wasserstein

SHARES = (0.55, 0.9, 0.95, 0.975, 0.9999)


@pytest.mark.parametrize("share", SHARES)
def test_quantiles_of_students_t_are_those_of_its_closed_forms(share):
    """Of 1, 2 and 4 degrees of freedom [Shaw 2006, J. Comput. Finance 9(4)], to the round-off that
    1 - share leaves.
    """
    rest = 4.0 * share * (1.0 - share)
    root = np.cos(np.arccos(np.sqrt(rest)) / 3.0) / np.sqrt(rest)
    closed = {
        1: np.tan(np.pi * (share - 0.5)),
        2: (2.0 * share - 1.0) * np.sqrt(2.0 / rest),
        4: 2.0 * np.sqrt(root - 1.0),
    }
    for freedom, expected in closed.items():
        assert student.quantile(share, freedom) == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("freedom", [1.3, 3.7, 9.0, 99.5, 1e5])
def test_quantiles_of_students_t_are_scipys(freedom):
    for share in SHARES:  # SciPy's own are good to 3e-9: at 4 degrees of freedom and 0.95 to 2.4e-9
        assert student.quantile(share, freedom) == pytest.approx(
            stats.t.ppf(share, freedom), rel=1e-8
        )
    assert student.quantile(0.95, freedom) != pytest.approx(stats.norm.ppf(0.95), rel=1e-8)


def test_the_distance_of_two_distributions_is_scipys():
    random = np.random.default_rng(1)
    for n, m in ((1, 1), (7, 300), (500, 500)):
        x, y = random.normal(size=n), random.normal(0.3, 2.0, size=m).round(1)  # some are the same
        a, b = random.uniform(0.1, 1.0, n), random.uniform(0.1, 1.0, m)
        expected = stats.wasserstein_distance(x, y, a, b)
        assert wasserstein(x, y, a, b) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("share", [0.0, 0.2, 0.35, 0.45, 0.6, 1.0])
def test_connected_regions_are_scipys(share):
    """Around 0.4 a mask of chance has regions that wind through all of it."""
    inside = np.random.default_rng(2).uniform(size=(60, 90)) < share
    expected, count = ndimage.label(inside, structure=np.ones((3, 3)))
    found = regions(inside)
    assert (found >= 0).tolist() == inside.tolist()
    pairs = set(zip(expected[inside].tolist(), found[inside].tolist()))
    assert len(pairs) == count == len({number for _, number in pairs})


def test_a_region_that_winds_is_one():
    spiral = np.zeros((9, 9), dtype=bool)
    spiral[::2] = True
    spiral[1::4, -1] = spiral[3::4, 0] = True
    assert len(set(regions(spiral)[spiral])) == 1
    spiral[5, -1] = False
    assert len(set(regions(spiral)[spiral])) == 2


def test_an_integral_is_scipys():
    at, values = np.random.default_rng(3).uniform(size=(2, 40)).cumsum(axis=1)
    assert integral(values, at) == pytest.approx(integrate.trapezoid(values, at), rel=1e-14)
