"""Holding stresses on an orthogonal periodic box by moving its sides."""

import numpy as np

from cases.errors import EngineError
from dem_reference.periodic.box import Box


class Servo:
    """Proportional-integral control of the box's principal stresses.

    rate_i = (x_i + z_i/(4 tau))/tau,  x_i = (target_i - sigma_i)/K,  z_i = integral of x_i dt,
    critically damped if the packing's stiffness is K = 0.3 E^(2/3) p^(1/3), that of a Hertzian
    packing of spheres; tau is a few passages of an elastic wave through the box. Rates [1/s] and
    stresses [Pa], compression positive.
    """

    INTERVAL = 50  # steps between corrections

    def __init__(self, box: Box, pressure: float, rate_limit: float):
        grains = box.grains
        self.box, self.rate_limit = box, rate_limit
        self.stiffness = 0.3 * grains.young_modulus ** (2 / 3) * pressure ** (1 / 3)
        wave_speed = np.sqrt(self.stiffness * (1 + box.void_ratio) / grains.density)
        self.tau = max(3 * box.sides.max() / wave_speed, 5 * self.INTERVAL * box.time_step)
        self.integral = np.zeros(3)

    def advance(self, targets: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """One interval; returns the stresses, (3,) [Pa].

        Sides with a finite target follow it, the others shrink at `rates`; both (3,).
        """
        held = np.isfinite(targets)
        error = np.where(held, targets - self.box.stress, 0.0) / self.stiffness
        self.integral += error * self.INTERVAL * self.box.time_step
        bound = 4 * self.tau**2 * self.rate_limit
        self.integral = np.clip(self.integral, -bound, bound)
        command = (error + self.integral / (4 * self.tau)) / self.tau
        self.box.deform(
            np.where(held, np.clip(command, -self.rate_limit, self.rate_limit), rates),
            self.INTERVAL,
        )
        return self.box.stress

    def isotropic(self, pressure: float, tolerance: float = 0.01, longest: int = 4000) -> None:
        """Brings all three stresses to `pressure` [Pa] and keeps them there.

        That is, within `tolerance` for 40 corrections in a row; EngineError when `longest`
        corrections do not do.
        """
        inside = 0
        for _ in range(longest):
            stress = self.advance(np.full(3, pressure), np.zeros(3))
            inside = inside + 1 if np.all(abs(stress / pressure - 1) < tolerance) else 0
            if inside == 40:
                return
        raise EngineError(
            f"servo: {pressure:g} Pa not held within {tolerance:.0%} after {longest} corrections "
            f"(stresses {', '.join(f'{s:.4g}' for s in stress)} Pa) lower the rate limit"
        )
