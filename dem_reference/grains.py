"""Grains and their contacts as numbers.

What LIGGGHTS' `hertz tangential history` computes with, and its time scales. Contact law of one
pair (Hertz-Mindlin with the damping of Tsuji et al. 1992, as LIGGGHTS 3.8 has it), with overlap
delta, normal n from second to first, v_n = relative velocity along n, v_t the slip velocity, s the
tangential spring:

    F_n = 4/3 Y* sqrt(R*) delta^(3/2) - gamma_n v_n
    F_t = -k_t s - gamma_t v_t  while |k_t s| <= mu |F_n|
    F_t = -mu |F_n| s/|s|       otherwise (s shortened to mu |F_n| / k_t)
    gamma_n = -2 sqrt(5/6) beta sqrt(S_n m*),  S_n = 2 Y* sqrt(R* delta)
    gamma_t = -2 sqrt(5/6) beta sqrt(S_t m*),  S_t = k_t = 8 G* sqrt(R* delta)
    beta = ln e / sqrt(ln^2 e + pi^2)
"""

from dataclasses import dataclass
from math import log, pi, sqrt

from cases.errors import CaseError, Failure

# Fewest steps that a head-on collision at sqrt(2 g H), the fastest there is, must last. The
# restitution realised is then within 1 % of the one asked for, in slower collisions better
# (test_dem_collision.py measures it).
LEAST_STEPS_PER_CONTACT = 10
# Above this fraction of the Rayleigh time LIGGGHTS' own check (fix check/timestep/gran) warns.
LARGEST_RAYLEIGH_FRACTION = 0.25
# Bounds LIGGGHTS puts on the Young modulus in SI units unless told otherwise [Pa].
PLAIN_YOUNG_MODULUS = (5e6, 1e9)


@dataclass(frozen=True)
class Grains:
    """Equal spheres of one material; SI units."""

    diameter: float  # d [m]
    density: float  # rho_s [kg/m3]
    young_modulus: float  # E [Pa]
    poisson_ratio: float  # nu [-]
    restitution: float  # e_n [-]
    friction: float  # mu [-]

    @classmethod
    def of(cls, case: dict, young_modulus: float | None = None) -> "Grains":
        """The grains of a scene: softened by dem.young_modulus, coarsened by dem.coarsening.

        `case` holds the tables of a resolved case; `young_modulus` [Pa] goes before its own.
        """
        g, dem = case["grains"], case["dem"]
        return cls(
            diameter=g["diameter"] * dem["coarsening"],
            density=g["density"],
            young_modulus=young_modulus or dem["young_modulus"] or g["young_modulus"],
            poisson_ratio=g["poisson_ratio"],
            restitution=g["restitution"],
            friction=g["friction"],
        )

    @property
    def radius(self) -> float:
        return self.diameter / 2

    @property
    def volume(self) -> float:
        """Of one grain [m3]."""
        return pi / 6 * self.diameter**3

    @property
    def mass(self) -> float:
        """Of one grain [kg]."""
        return self.density * self.volume

    @property
    def inertia(self) -> float:
        return 0.4 * self.mass * self.radius**2

    @property
    def contact_modulus(self) -> float:
        """Y* = E / (2 (1 - nu^2)) of two equal grains [Pa]."""
        return self.young_modulus / (2 * (1 - self.poisson_ratio**2))

    @property
    def contact_shear_modulus(self) -> float:
        """G* = E / (4 (2 - nu) (1 + nu)) of two equal grains [Pa]."""
        return self.young_modulus / (4 * (2 - self.poisson_ratio) * (1 + self.poisson_ratio))

    @property
    def damping_factor(self) -> float:
        """-2 sqrt(5/6) beta, so that gamma = damping_factor sqrt(S m*) >= 0 [-]."""
        ln_e = log(self.restitution)
        return -2 * sqrt(5 / 6) * ln_e / sqrt(ln_e**2 + pi**2)

    def rayleigh_time(self) -> float:
        """Time a Rayleigh wave takes over half a grain's circumference [s].

        pi r sqrt(rho/G) / (0.1631 nu + 0.8766).
        """
        shear_modulus = self.young_modulus / (2 * (1 + self.poisson_ratio))
        return (
            pi
            * self.radius
            * sqrt(self.density / shear_modulus)
            / (0.1631 * self.poisson_ratio + 0.8766)
        )

    def contact_time(self, speed: float) -> float:
        """Duration of an undamped head-on Hertz collision at relative `speed` [m/s], in s:

        2.87 (m*^2 / (R* Y*^2 v))^(1/5).
        """
        m, r = self.mass / 2, self.radius / 2
        return 2.87 * (m**2 / (r * self.contact_modulus**2 * speed)) ** 0.2

    def binary_contact_time(self, gravity: float) -> float:
        """Unit in which contact lifetimes are counted [s]: Hertz time at the speed sqrt(g d)."""
        return self.contact_time(sqrt(gravity * self.diameter))

    def strain_rate(self, inertial_number: float, pressure: float) -> float:
        """Strain rate of an inertial number under `pressure` [Pa]: I sqrt(p/rho_s)/d [1/s]."""
        return inertial_number * sqrt(pressure / self.density) / self.diameter


def time_step(grains: Grains, fraction: float, height: float, gravity: float) -> float:
    """Time step [s] = fraction of the Rayleigh time.

    CaseError when it would not resolve a contact after a fall from `height` [m].
    """
    dt = fraction * grains.rayleigh_time()
    speed = sqrt(2 * gravity * height)
    if fraction > LARGEST_RAYLEIGH_FRACTION:
        raise CaseError(
            f"dem.time_step_fraction: {fraction:g} of the Rayleigh time is above the contact limit "
            f"(at most {LARGEST_RAYLEIGH_FRACTION:g}) lower it",
            Failure.REFUSED,
        )
    steps = grains.contact_time(speed) / dt
    if steps < LEAST_STEPS_PER_CONTACT:
        raise CaseError(
            f"dem.time_step_fraction: a grain that falls from H = {height:g} m hits for "
            f"{steps:.1f} steps only (at least {LEAST_STEPS_PER_CONTACT} resolve the contact) "
            f"use at most {0.99 * fraction * steps / LEAST_STEPS_PER_CONTACT:.3g}",
            Failure.REFUSED,
        )
    return dt
