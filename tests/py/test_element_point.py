"""mpm_point, the solver's law, against the closed forms on the element tests' paths."""
import numpy as np
import pytest

from compare.element.card import Card
from compare.element.model import Model
from compare.element.point import PointModel
from cases.programs import program
from dem_reference.grains import Grains

pytestmark = pytest.mark.skipif(not program("mpm_point").exists(), reason="mpm_point is not built")
GRAINS = Grains(2e-3, 2532.0, 3e8, 0.3, 0.879, 0.5)


CARDS = {name: Card.read(name) for name in ("seed_table1", "dem_mu05")}
CARDS["contact_share"] = CARDS["dem_mu05"].with_values(
    law="contact_share",
    correlation_length="softened",
    correlation_onset=6.7,
    contact_share=0.12,
    effective_restitution=0.54,
    collision_time_factor=4.2,
)
CARDS["fabric"] = CARDS["contact_share"].with_values(fabric_strain=0.2)


@pytest.fixture(params=CARDS)
def models(request):
    card = CARDS[request.param]
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


@pytest.mark.parametrize(("nu", "strain"), [(0.57, [0.02, 0.1, 1.0]), (0.59, [1.0])])
def test_reversal(models, nu, strain):
    """From rest and turned round within 3 %; denser than critical once the dilatancy is past.

    A path of steps of 1e-4 strain, at 0.02 of it, is 0.5 % behind where T rises fastest.
    """
    at = np.array(strain)
    driven, closed = (model.reversal([nu, nu], [100.0, 20.0], at, 2.0) for model in models)
    for name in closed:
        assert driven[name] == pytest.approx(closed[name], rel=0.03), name
    # the control: not there yet
    rise = models[1].reversal(0.57, 100.0, np.array([0.002, 1.0]), 2.0)["granular_temperature"]
    assert rise[0, 0, 0] < 0.5 * rise[0, 0, 1]


def test_a_fabric_is_what_turns(models):
    """Only with one the pressure falls when the flow turns."""
    for model in models:
        (pressure,) = model.reversal(0.58, 20.0, np.array([0.15, 1.9]), 2.0)["pressure"][1]
        falls = pressure[0] < 0.3 * pressure[1]
        assert falls == (model.card.fabric_strain > 0)


def test_a_share_of_contacts_is_told_from_none(models):
    """The agreement above is no agreement of anything: half of the share is another stress."""
    driven, closed = models
    if closed.card.law != "contact_share":
        return
    half = Model(closed.card.with_values(contact_share=0.06), GRAINS)
    stress = [model.shear(0.58, 20.0)["shear_stress"] for model in (driven, closed, half)]
    assert stress[0] == pytest.approx(stress[1], rel=0.02)
    assert stress[0] != pytest.approx(stress[2], rel=0.05)


def test_cooling(models):
    """Backward Euler in sqrt(T) is of first order: 1 % with these steps."""
    nu = np.array([0.3, 0.5, 0.57])
    driven, closed = (model.cooling_time(nu, 1e-2, 1e-3) for model in models)
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
