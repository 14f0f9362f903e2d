"""The closed forms against model limits and against integration of the rates they solve."""
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cases import case
from cases.programs import ROOT
from compare.element.card import Card
from compare.element.cone import simple_shear_ratio
from compare.element.model import Model
from dem_reference.grains import Grains


@pytest.mark.parametrize(
    "given", [(0.879, 0.5, 0.44), (0.95, 0.1, 0.2), (0.2, 1.0, 0.9), (0.7, 0.0, 0.4)]
)
def test_effective_restitution_is_the_validators(given):
    """Where no card gives it, both sides derive it from the grains: to the last digits of it."""
    restitution, friction, tangential = given
    assignments = [
        f"grains.restitution={restitution}",
        f"grains.friction={friction}",
        f"material.tangential_restitution={tangential}",
        "material.card=",
    ]
    scene = case.load(ROOT / "cases" / "column", assignments)
    card = Card.read("seed_table1").with_values(
        effective_restitution=0.0, tangential_restitution=tangential
    )
    law = Model(card, Grains(2e-3, 2532.0, 3e8, 0.3, restitution, friction))
    assert law.effective_restitution == pytest.approx(
        scene["material.effective_restitution"], rel=1e-12, abs=1e-15
    )
    own = Model(card.with_values(effective_restitution=0.7), law.grains)
    assert own.effective_restitution == 0.7


@pytest.fixture
def model():
    return Model(Card.read("seed_table1"), Grains(2e-3, 2532.0, 3e8, 0.3, 0.879, 0.5))


def test_limits_of_the_collisional_part(model):
    """Hard limit of J, correlation length and temperature at e_c; dilute gas: p = rho nu T."""
    assert model.J(model.nu_c) == pytest.approx(1.1388, abs=5e-5)
    assert model.correlation_length(model.nu_c) == pytest.approx(1.716, abs=5e-4)
    steady = model.shear(model.nu_c, 10.0)
    assert steady["granular_temperature"] / (10 * 2e-3) ** 2 == pytest.approx(0.3996, abs=5e-5)
    assert steady["pressure"] == pytest.approx(8947, rel=1e-3)
    assert steady["shear_stress"] == pytest.approx(3872, rel=1e-3)
    thin = model.shear(1e-3, 10.0)
    assert thin["pressure"] == pytest.approx(2532 * 1e-3 * thin["granular_temperature"], rel=1e-2)


def test_bagnold_scaling_below_and_linear_at_the_critical_void_ratio(model):
    slow, fast = (model.shear(np.array([0.4, model.nu_c]), rate)["pressure"] for rate in (1.0, 2.0))
    assert fast / slow == pytest.approx([4.0, 2.0], rel=1e-3)


def test_cooling_time_solves_the_temperature_equation(model):
    """dT/dt = -(2/3) Gamma/(rho nu), Gamma = (12/sqrt(pi)) (1 - ee^2) rho nu Y T^1.5/L."""
    nu, ee = 0.45, model.card.effective_restitution
    length = model.correlation_length(nu) * model.grains.diameter

    def cool(_, T):
        Y = 1 / (model.inverse_G(nu) + model.kappa * np.sqrt(T))
        return -8 / np.sqrt(np.pi) * (1 - ee**2) * Y * T**1.5 / length

    times = model.cooling_time(nu, 1e-2, np.array([5e-3, 1e-3, 1e-4]))
    solved = solve_ivp(cool, (0, times[-1]), [1e-2], t_eval=times, rtol=1e-10, atol=1e-16)
    assert solved.y[0] == pytest.approx([5e-3, 1e-3, 1e-4], rel=1e-7)


def test_simple_shear_on_the_cone_is_isochoric_pure_shear():
    """At the closed form the flow dev(eta - eta.eta) has an xy part alone, for any M_c.

    And the cone's equation holds.
    """
    for m in (0.5, 0.9, 1.2):
        t = simple_shear_ratio(m)
        c = (-3 + np.sqrt(9 + 12 * t**2)) / 6  # t^2 = 3 c (1 + c)
        eta = np.array([[c, t, 0], [t, c, 0], [0, 0, -2 * c]])
        flow = eta - eta @ eta + np.trace(eta @ eta) / 3 * np.eye(3)
        assert np.diag(flow) == pytest.approx(0, abs=1e-14)
        assert np.trace(eta @ eta) / 2 - np.trace(eta @ eta @ eta) / 3 == pytest.approx(
            m**2 / 3 - 2 * m**3 / 27, rel=1e-12
        )


def test_triaxial_elastic_strain_integrates_the_hyperelastic_tangent(model):
    """Strains at constant lateral stress by the (p, q) tangent of the Gibbs energy."""
    k, g, n, pa = 380.0, 48.0, 0.5, 1e5
    lateral, q_end = 2e4, 2e4

    def rates(q, _):
        p = lateral + q / 3
        P2 = p**2 + k * (1 - n) * q**2 / (3 * g)
        B = pa * (np.sqrt(P2) / pa) ** n
        coupling = n * k * B * p * q / P2
        tangent = [
            [k * B * (1 - n + n * p**2 / P2), coupling],
            [coupling, 3 * g * B + n * k * B * q**2 / P2],
        ]
        volume, shear = np.linalg.solve(tangent, [1 / 3, 1.0])
        return [shear + volume / 3, volume]

    solved = solve_ivp(rates, (0, q_end), [0.0, 0.0], rtol=1e-10, atol=1e-15).y[:, -1]
    assert np.array(model.triaxial_elastic(lateral, q_end)) == pytest.approx(solved, rel=1e-6)


def test_triaxial_ends_at_the_critical_state_from_both_sides(model):
    for void_ratio in (0.60, 0.78):
        end = model.triaxial(void_ratio, 2e4, np.array([3.0]))
        assert end["void_ratio"][0] == pytest.approx(
            float(model.critical_void_ratio(end["pressure"][0])), abs=1e-3
        )
        assert end["deviator"][0] / end["pressure"][0] == pytest.approx(0.9, rel=1e-12)
