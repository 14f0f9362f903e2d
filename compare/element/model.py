"""The solid-fluid law and ours, with a contact share, on the element tests' paths, in closed form.

An independent check of the C++, and what calibration fits. Simple shear, homogeneous cooling,
triaxial compression after yield and isotropic compression need no stress integration.
Symbols as in [Ceccato2019]; compression positive; nu = 1/(1 + e).
"""

from dataclasses import dataclass
from functools import cached_property
from math import exp
from typing import Protocol

import numpy as np

from compare.element.card import Card
from compare.element.collisions import effective_restitution, inverse_contact_value
from compare.element.collisions import jenkins_length
from compare.element.cone import simple_shear_ratio
from dem_reference.grains import Grains

LONGEST = 30.0  # of the correlation length `softened` [d]
DENSE = 0.49  # solid fraction above which collisions correlate [Berzi2014]
# Random close packing of spheres, where the correlation length diverges [Berzi2014].
RANDOM_CLOSE = 0.636
# m of the critical-state locus, by its form.
EXPONENT = {"linear": 1.0, "two_thirds": 1.5, "square_root": 2.0}
SQRT_PI = np.sqrt(np.pi)
SHEARED = ("granular_temperature", "pressure", "shear_stress")


class Law(Protocol):
    """What answers for the law in an element test: Model in closed form, PointModel by the C++."""

    @property
    def grains(self) -> Grains:
        ...

    @property
    def nu_c(self) -> float:
        ...

    def __hash__(self) -> int:
        ...

    def frictionless(self) -> "Law":
        ...

    def shear(self, nu, rate) -> dict:
        ...

    def reversal(self, nu, rate, strain, span: float) -> dict:
        ...

    def cooling_time(self, nu, T0, T):
        ...

    def isotropic(self, void_ratio, pressure, pressures):
        ...

    def triaxial(self, void_ratio: float, lateral: float, axial_strain) -> dict:
        ...

    def moduli(self, pressure):
        ...


@dataclass(frozen=True)
class Model:
    """A card for given grains. Arguments may be arrays unless said otherwise."""

    card: Card
    grains: Grains

    @property
    def nu_c(self) -> float:
        return 1 / (1 + self.card.critical_void_ratio)

    @property
    def effective_restitution(self) -> float:
        """The card's, or what the grains determine where it has none (0)."""
        return self.card.effective_restitution or max(
            0.0,
            effective_restitution(
                self.grains.restitution, self.grains.friction, self.card.tangential_restitution
            ),
        )

    def frictionless(self) -> "Model":
        """Plain kinetic theory for mu = 0.

        e_n dissipates, and the contact value diverges at random close packing.
        """
        card = self.card.with_values(
            effective_restitution=self.grains.restitution,
            correlation_length="none",
            critical_void_ratio=1 / RANDOM_CLOSE - 1,
        )
        return Model(card, self.grains)

    # --- collisional part -------------------------------------------------------------------------

    def inverse_G(self, nu, structure=1.0):
        """1/G = 1/(nu g0), zero at and above nu_c.

        Grains without the `structure` that shear makes, from 0 to 1, jam at random close packing
        in a law that has a fabric: 1/G is the mean of both by `structure`.
        """
        nu_m = 1 / (1 + self.card.loose_void_ratio)
        if self.card.fabric_strain == 0 or np.all(structure == 1):
            return inverse_contact_value(nu, nu_m, self.nu_c)
        loose = inverse_contact_value(nu, nu_m, RANDOM_CLOSE)
        return loose + structure * (inverse_contact_value(nu, nu_m, self.nu_c) - loose)

    def F(self, nu, structure=1.0):
        """F = (1 + e_n)/2 + 1/(4 G)."""
        return (1 + self.grains.restitution) / 2 + self.inverse_G(nu, structure) / 4

    def J(self, nu, structure=1.0):
        """J of Garzo & Dufty 1999; 1/G^2 carried so that it holds at G = infinity."""
        e, x = self.grains.restitution, self.inverse_G(nu, structure)
        numerator = (5 * x + 2 * (1 + e) * (3 * e - 1)) * (5 * x + 4 * (1 + e))
        return (1 + e) / 2 + np.pi / 32 * numerator / (24 - 6 * (1 - e) ** 2 - 5 * (1 - e**2))

    def correlation_length(self, nu, speed=0.0, structure=1.0):
        """L/d in steady shear; the card's factor multiplies its excess over 1.

        `speed` = sqrt(T) [m/s] and `structure` matter to the length `softened` alone,
        L/d = (Y/Y_0)^(1/3) between 1 and 30, Y = 1/(1/G + kap speed) without collision-time factor.
        """
        return self.length(nu, self.inverse_G(nu, structure), speed)

    def length(self, nu, inverse, speed):
        """L/d where 1/G is `inverse`, for the length that depends on it."""
        nu = np.asarray(nu, dtype=float)
        ee = self.effective_restitution
        if self.card.correlation_length == "none":
            return np.ones_like(nu)
        if self.card.correlation_length == "softened":
            softened = inverse + self.kappa / self.card.collision_time_factor * speed
            onset = self.card.correlation_onset
            return np.clip((onset * np.maximum(softened, 1e-9)) ** (-1 / 3), 1, LONGEST)
        if self.card.correlation_length == "jenkins":
            x = np.maximum(self.inverse_G(nu), 1e-12)
            length = jenkins_length(
                0.0625 * x ** (-2 / 3) * 15 * (1 - ee**2) / (2 * self.J(nu)),
                self.card.correlation_factor,
            )
        else:
            # sqrt(2 J/(15 (1 - ee^2))) [1 + 26 (1 - ee)/15 (nu - 0.49)/(nu_rcp - nu)]^(3/2)
            excess = 26 * (1 - ee) / 15 * (nu - DENSE) / np.maximum(RANDOM_CLOSE - nu, 1e-3)
            length = (
                np.sqrt(2 * self.J(nu) / (15 * (1 - ee**2))) * (1 + np.maximum(excess, 0)) ** 1.5
            )
            length = np.where(nu > DENSE, np.maximum(length, 1), 1.0)
        return 1 + self.card.correlation_factor * (length - 1)

    @property
    def kappa(self) -> float:
        """kap = (24/(5 sqrt(pi))) sqrt(rho_s/E_p), times the collision-time factor [s/m]."""
        softness = np.sqrt(self.grains.density / self.grains.young_modulus)
        return 24 / (5 * SQRT_PI) * softness * self.card.collision_time_factor

    # --- quasi-static part ------------------------------------------------------------------------

    def critical_pressure(self, nu):
        """p_cs = a_L E_p max(nu - nu_c, 0)^m [Pa]."""
        exponent = EXPONENT[self.card.critical_state_form]
        return (
            self.card.critical_state_slope
            * self.grains.young_modulus
            * np.maximum(nu - self.nu_c, 0) ** exponent
        )

    def critical_void_ratio(self, pressure):
        """e_cs(p), the inverse of critical_pressure."""
        exponent = EXPONENT[self.card.critical_state_form]
        rise = (pressure / (self.card.critical_state_slope * self.grains.young_modulus)) ** (
            1 / exponent
        )
        return 1 / (self.nu_c + rise) - 1

    @cached_property
    def shear_ratio(self) -> float:
        """s/p at the critical state in simple shear: on the cone, with isochoric plastic flow."""
        return simple_shear_ratio(self.card.stress_ratio)

    def moduli(self, pressure):
        """Tangent bulk and shear modulus on the isotropic axis [Pa].

        k pa (p/pa)^n and g pa (p/pa)^n.
        """
        scale = (
            self.card.atmospheric_pressure
            * (pressure / self.card.atmospheric_pressure) ** self.card.stiffness_exponent
        )
        return self.card.bulk_stiffness * scale, self.card.shear_stiffness * scale

    # --- the tests --------------------------------------------------------------------------------

    def shear(self, nu, rate) -> dict:
        """Steady simple shear at constant volume.

        granular_temperature [m2/s2], pressure and shear_stress [Pa]:

            T/(gdot d)^2 = (2 J/15) (L/d)/(1 - ee^2),  Y = 1/(1/G + kap sqrt(T))
            p = 4 nu Y F rho T + p_cs
            s = 8 J nu Y rho d sqrt(T) gdot/(5 sqrt(pi)) + (s/p)_cs p_cs

        The law contact_share multiplies the first part of s by 1 + chi (L/d - 1).
        """
        nu, rate = np.asarray(nu, dtype=float), np.asarray(rate, dtype=float)
        return self.sheared(nu, rate, self.steady_speed(nu, rate))

    def steady_speed(self, nu, rate):
        """sqrt(T) of steady simple shear [m/s].

        A length that depends on T falls as T^(-1/6) at most, so that a round leaves a sixth of the
        error.
        """
        loss = 15 * (1 - self.effective_restitution**2) / 2
        speed = rate * self.grains.diameter
        for _ in range(20 if self.card.correlation_length == "softened" else 1):
            length = self.correlation_length(nu, speed)
            speed = rate * self.grains.diameter * np.sqrt(self.J(nu) / loss * length)
        return speed

    def sheared(self, nu, rate, speed, structure=1.0, along=None) -> dict:
        """What `shear` returns at another granular temperature, `structure` and alignment.

        `along` = a:n of the fabric, 1/sqrt(1 + gamma_s^2) in steady shear.
        """
        d, rho = self.grains.diameter, self.grains.density
        Y = 1 / (self.inverse_G(nu, structure) + self.kappa * speed)
        p_q = self.critical_pressure(nu)
        share = 0.0
        if self.card.law == "contact_share":
            steady = 1 / np.hypot(1, self.card.fabric_strain)
            excess = self.correlation_length(nu, speed, structure) - 1
            share = self.card.contact_share * excess * (steady if along is None else along)
        viscosity = 8 * self.J(nu, structure) * nu * Y * rho * d * speed / (5 * SQRT_PI)
        return {
            "granular_temperature": speed**2,
            "pressure": 4 * nu * Y * self.F(nu, structure) * rho * speed**2 + p_q,
            "shear_stress": (1 + share) * viscosity * rate + self.shear_ratio * p_q,
        }

    def reversal(self, nu, rate, strain, span: float) -> dict:
        """Simple shear at constant volume from rest to the strain `span`, and back.

        As `shear`, each (2, points, n): at `strain` (n,) since the start, and since the turn, of
        points `nu`, `rate` (points,); the shear stress in the sense of the flow. T follows

            dv/d gamma = (H gdot^2 - Q v^2)/(3 gdot (1/G + kap v)),  v = sqrt(T),
            H = 8 J d/(5 sqrt(pi)),  Q = 12 (1 - ee^2)/(sqrt(pi) L),

        exactly over steps in which G, L and the Y of their start are kept. The strain in which
        dilatancy comes to its end is left out: the quasi-static stress is critical at once.
        """
        nu, rate = (np.atleast_1d(np.asarray(x, dtype=float)) for x in (nu, rate))
        d, ee = self.grains.diameter, self.effective_restitution
        grid = span * np.linspace(0, 1, 161) ** 2  # fine where things change
        speed, fabric, legs = 1e-3 * rate * d, 0j, []
        for _ in range(2):
            fabrics = self.fabric(grid, fabric)
            x = np.minimum(1.0, np.abs(fabrics))[:, None]
            inverse, speeds = self.inverse_G(nu, x) + 0 * x, []
            H = 8 * self.J(nu, x) * d / (5 * SQRT_PI) + 0 * x
            for n, step in enumerate(np.diff(grid, prepend=0.0)):
                Q = 12 * (1 - ee**2) / (SQRT_PI * self.length(nu, inverse[n], speed) * d)
                end = rate * np.sqrt(H[n] / Q)
                passed = (
                    rate**2 * H[n] / end / (3 * rate * (inverse[n] + self.kappa * speed)) * step
                )
                speed = end * (speed + end * np.tanh(passed)) / (end + speed * np.tanh(passed))
                speeds.append(speed)
            along = np.maximum(0.0, fabrics.real)[:, None]
            answer = self.sheared(nu, rate, np.array(speeds), x, along)
            legs.append(np.stack([answer[name] for name in SHEARED], axis=1))
            fabric = -np.conj(fabrics[-1])
        from scipy.interpolate import interp1d  # of packages-studies.txt

        at = interp1d(grid, np.array(legs), axis=1)(np.asarray(strain, dtype=float))
        return {name: at[..., i, :].swapaxes(1, 2) for i, name in enumerate(SHEARED)}

    def fabric(self, strain, start: complex):
        """a of the law contact_share in simple shear: along the flow, and, imaginary, beside it.

        dz/d gamma = (sqrt(1 + gamma_s^2) - z)/gamma_s + i z from `start`; seen from a flow that has
        turned round, z is - conj z.
        """
        gamma_s = self.card.fabric_strain
        if gamma_s == 0:
            return np.ones_like(strain, dtype=complex)
        steady = np.hypot(1, gamma_s) / (1 - 1j * gamma_s)
        return steady + (start - steady) * np.exp((1j - 1 / gamma_s) * strain)

    def cooling_time(self, nu, T0, T):
        """When homogeneous cooling has brought T0 down to T [s].

        (1/G + kap v) dv/dt = -c v^2 with v = sqrt(T), c = 4 (1 - ee^2)/(sqrt(pi) L), so
        t = [ (1/v - 1/v0)/G + kap ln(v0/v) ]/c unless L depends on v. Jenkins' L is d where nothing
        is sheared.
        """
        v0, v = np.sqrt(T0), np.sqrt(T)
        c = 4 * (1 - self.effective_restitution**2) / (SQRT_PI * self.grains.diameter)
        if self.card.correlation_length != "softened":
            sheared = self.card.correlation_length == "jenkins"
            c = c / (1.0 if sheared else self.correlation_length(nu))
            return (self.inverse_G(nu) * (1 / v - 1 / v0) + self.kappa * np.log(v0 / v)) / c
        # a length that changes on the way, of a gas without structure: Gauss-Legendre in ln v
        nodes, weights = np.polynomial.legendre.leggauss(64)
        half = np.log(v0 / v) / 2
        speed = np.exp(np.log(v0 * v)[..., None] / 2 + half[..., None] * nodes)
        nu = np.asarray(nu, dtype=float)[..., None]
        rate = c * speed / (self.inverse_G(nu, 0.0) + self.kappa * speed)
        return half * ((self.correlation_length(nu, speed, 0.0) / rate) @ weights)

    def isotropic(self, void_ratio, pressure, pressures):
        """Void ratio at `pressures` on the elastic path through (void_ratio, pressure)."""
        n, pa = self.card.stiffness_exponent, self.card.atmospheric_pressure

        def strain(p):
            return (p / pa) ** (1 - n) / (self.card.bulk_stiffness * (1 - n))

        return (1 + void_ratio) * np.exp(strain(pressure) - strain(pressures)) - 1

    def triaxial(self, void_ratio: float, lateral: float, axial_strain) -> dict:
        """Drained triaxial compression from isotropic `lateral` stress [Pa] at `void_ratio`.

        Elastic at constant lateral stress until q = M_c p; then the stress stays, and with it the
        elastic strain: d eps_v = D d eps_q, D = A_psi (e - e_cs(p)) bounded by min(0.5, M_c/2),
        eps_q = eps_a - eps_v/3. Returns, at each axial strain, deviator and pressure [Pa],
        void_ratio and volumetric_strain [-].
        """
        axial_strain = np.asarray(axial_strain, dtype=float)
        m_c = self.card.stress_ratio
        q_yield = 3 * lateral * m_c / (3 - m_c)
        strain_yield, volume_yield = self.triaxial_elastic(lateral, q_yield)
        e_cs = self.critical_void_ratio(lateral + q_yield / 3)
        bound = min(0.5, 0.5 * m_c)
        rate = {
            "stress_ratio_over_delta": m_c / self.card.dilatancy,
            "delta": self.card.dilatancy,
            "none": 0.0,
        }[self.card.dilatancy_form]

        def slope(volume: float) -> float:  # d eps_v/d eps_a = D/(1 + D/3)
            D = min(max(rate * ((1 + void_ratio) * exp(-volume) - 1 - e_cs), -bound), bound)
            return D / (1 + D / 3)

        end = max(axial_strain.max(), strain_yield)
        strains = np.linspace(strain_yield, end, 101)
        volumes = [float(volume_yield)]
        h = strains[1] - strains[0]
        for _ in strains[1:]:  # classical Runge-Kutta
            v = volumes[-1]
            a = slope(v)
            b = slope(v + h / 2 * a)
            c = slope(v + h / 2 * b)
            volumes.append(v + h / 6 * (a + 2 * b + 2 * c + slope(v + h * c)))
        q_grid = np.linspace(0, q_yield, 200)
        elastic_strain, elastic_volume = self.triaxial_elastic(lateral, q_grid)
        q = np.interp(axial_strain, elastic_strain, q_grid)
        volume = np.interp(
            axial_strain,
            np.concatenate([elastic_strain, strains[1:]]),
            np.concatenate([elastic_volume, volumes[1:]]),
        )
        return {
            "deviator": q,
            "pressure": lateral + q / 3,
            "volumetric_strain": volume,
            "void_ratio": (1 + void_ratio) * np.exp(-volume) - 1,
        }

    def triaxial_elastic(self, lateral, q):
        """Axial and volumetric strain from isotropic `lateral` stress to deviator q.

        By Houlsby, Amorosi & Rojas 2005: eps_v = p P0^-n/(k (1 - n) pa^(1-n)) + const,
        eps_q = q P0^-n/(3 g pa^(1-n)), P0^2 = p^2 + k (1 - n) q^2/(3 g).
        """
        k, g, n, pa = (
            self.card.bulk_stiffness,
            self.card.shear_stiffness,
            self.card.stiffness_exponent,
            self.card.atmospheric_pressure,
        )
        p = lateral + q / 3
        P0 = np.sqrt(p**2 + k * (1 - n) * q**2 / (3 * g))
        volume = (p * P0**-n - lateral ** (1 - n)) / (k * (1 - n) * pa ** (1 - n))
        return q * P0**-n / (3 * g * pa ** (1 - n)) + volume / 3, volume
