"""A steady flow down a plane that is known: Bagnold's profile, and what is measured of it."""

import numpy as np

from compare.chute import flow
from compare.maps.profiles import Profile

D, RHO, NU, DEPTH, SLOPE = 2e-3, 2500.0, 0.55, 0.024, 26.0


def bagnold_profile(power: float = 1.5, off: float = 1.0) -> Profile:
    """A layer of constant density with that profile; off: factor of its shear stress."""
    y = np.arange(-0.004, 0.03, 2.5e-4) + 1.25e-4
    there = (y > 0) & (y < DEPTH)
    nu = np.where(there, NU, 0.0)
    left = np.clip(DEPTH - y, 0.0, DEPTH)
    v = np.where(there, 20.0 * (DEPTH**power - left**power) * DEPTH ** (1.5 - power), 0.0)
    g, angle = 9.81, np.radians(SLOPE)
    stress = np.zeros((len(y), 3, 3))
    base_pressure = RHO * NU * g * left * (y > 0)
    stress[:, 1, 1] = base_pressure * np.cos(angle)
    stress[:, 0, 1] = stress[:, 1, 0] = -off * base_pressure * np.sin(angle)
    rate = np.gradient(v, y)
    velocity = np.column_stack([v, 0 * v, 0 * v])
    fields = {
        "density": RHO * nu,
        "solid_fraction": nu,
        "velocity": velocity,
        "momentum": RHO * nu[:, None] * velocity,
        "granular_temperature": 0.4 * (rate * D) ** 2,
        "contact_stress": stress,
        "kinetic_stress": 0 * stress,
    }
    return Profile(y, fields, 2.25 * D, D, (False, False))


def measured(profile: Profile, halves=(1.0, 1.0)) -> flow.Flow:
    g, angle = 9.81, np.radians(SLOPE)
    scale = {"diameter": D, "density": RHO, "height": DEPTH, "area": 1.0, "mass": RHO * NU * DEPTH}
    return flow.measure("x", profile, halves, (g * np.sin(angle), g * np.cos(angle)), scale)
