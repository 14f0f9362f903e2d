"""The grains of an element test and the numbers that follow from them (SI units)."""
from dataclasses import dataclass
from math import pi, sqrt


@dataclass(frozen=True)
class Grains:
    """Monodisperse spheres: d [m], rho_s [kg/m3], E_p [Pa], Poisson ratio, e_n and mu [-]."""

    diameter: float
    density: float
    young_modulus: float
    poisson_ratio: float
    restitution: float
    friction: float

    @property
    def volume(self) -> float:
        """Volume of one grain [m3]."""
        return pi * self.diameter**3 / 6

    @property
    def mass(self) -> float:
        """Mass of one grain [kg]."""
        return self.density * self.volume

    def time_step(self, fraction: float) -> float:
        """`fraction` of the Rayleigh time pi r sqrt(rho/G)/(0.1631 nu + 0.8766) [s]."""
        shear_modulus = self.young_modulus / (2 * (1 + self.poisson_ratio))
        rayleigh = pi * self.diameter / 2 * sqrt(self.density / shear_modulus)
        return fraction * rayleigh / (0.1631 * self.poisson_ratio + 0.8766)
