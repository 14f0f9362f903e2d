"""mpm_point, the solver's law, against the closed forms on the element tests' paths."""
import numpy as np
import pytest

from compare.element.model import Card, Model
from compare.element.point import PointModel
from cases.programs import program
from dem_reference.grains import Grains

pytestmark = pytest.mark.skipif(not program("mpm_point").exists(), reason="mpm_point is not built")
GRAINS = Grains(2e-3, 2532.0, 3e8, 0.3, 0.879, 0.5)


@pytest.fixture(params=["seed_table1", "dem_mu05"])
def models(request):
    card = Card.read(request.param)
    return PointModel(card, GRAINS), Model(card, GRAINS)


@pytest.mark.parametrize("rate", [20.0, 500.0])
def test_steady_shear(models, rate):
    """Below e_c all collisional, above it with the quasi-static part: p, s and T within 2 %."""
    nu = np.array([0.30, 0.50, 0.58, 0.59])
    driven, closed = (model.shear(nu, rate) for model in models)
    for name in closed:
        assert driven[name] == pytest.approx(closed[name], rel=0.02), name


@pytest.mark.parametrize("factor", [0.5, 1.0, 3.0])
def test_jenkins_length_with_a_factor(factor):
    """Where it is one, where it grows and, at e_c, at its cap; nothing of it while cooling."""
    card = Card.read("seed_table1").with_values(
        correlation_length="jenkins", correlation_factor=factor
    )
    driven, closed = PointModel(card, GRAINS), Model(card, GRAINS)
    nu = np.array([0.30, 0.54, 0.58, closed.nu_c])
    assert closed.correlation_length(nu)[[0, -1]] == pytest.approx([1.0, 1 + 9 * factor])
    steady = driven.shear(nu, 20.0)["granular_temperature"]
    assert steady == pytest.approx(closed.shear(nu, 20.0)["granular_temperature"], rel=0.02)
    cooled = (np.array([0.3, 0.5]), 1e-2, 1e-3)
    assert driven.cooling_time(*cooled) == pytest.approx(closed.cooling_time(*cooled), rel=0.01)


def test_cooling(models):
    """Backward Euler in sqrt(T) is of first order: 1 % with these steps."""
    driven, closed = (model.cooling_time(np.array([0.3, 0.5]), 1e-2, 1e-3) for model in models)
    assert driven == pytest.approx(closed, rel=0.01)


def test_moduli_and_isotropic_path(models):
    pressure = np.array([1e3, 1e4, 1e5])
    (bulk, shear), (closed_bulk, closed_shear) = (model.moduli(pressure) for model in models)
    # The program's stress acts on the solid's volume, which shrinks: its tangent at fixed grains is
    # K + p.
    assert bulk == pytest.approx(closed_bulk + pressure, rel=0.005)
    assert shear == pytest.approx(closed_shear, rel=0.005)
    driven, closed = (model.isotropic(0.6, 1e3, np.array([3e3, 3e4])) for model in models)
    assert driven == pytest.approx(closed, abs=5e-4)


def test_triaxial(models):
    strain = np.array([0.05, 0.1, 0.2, 0.4])
    for void_ratio in (0.56, 0.735):
        driven, closed = (model.triaxial(void_ratio, 2e4, strain) for model in models)
        assert driven["void_ratio"] == pytest.approx(closed["void_ratio"], abs=2e-3)
        assert driven["deviator"] == pytest.approx(closed["deviator"], rel=0.01)
