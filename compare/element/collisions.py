"""Collisions of frictional grains, as the law's closed form has them beside the C++."""

from math import atan, pi

import numpy as np


def effective_restitution(restitution: float, friction: float, tangential: float) -> float:
    """Restitution [-] of a frictional collision, for kinetic theory to dissipate by [Jenkins2002].

    From normal restitution, friction and the tangential restitution of collisions that stick.
    """
    if friction == 0:
        return restitution
    mu0 = 7 / 2 * friction * (1 + restitution) / (1 + tangential)
    A = pi / 2 * mu0 * (1 - 2 / pi * atan(mu0))
    a1 = friction / mu0 * (2 * A + 2 * mu0**2 / (1 + mu0**2) * (1 - 2 * friction / mu0))
    a2 = 5 / 2 * friction / mu0 * (A + (mu0**2 - mu0**4) / (1 + mu0**2) ** 2)
    b1 = friction**2 / (1 + mu0**2)
    b2 = friction / (2 * mu0) * (A + mu0**2 / (1 + mu0**2))
    return restitution - (a1 - a2 * b1 / b2) / 2


def jenkins_length(a, factor: float):
    """Jenkins' length l = G^(1/3)/4 gdot d/sqrt(T) in steady shear, from 1 to 10 [-].

    With T of Model.shear, l^2 (1 + factor (l - 1)) = a, G^(2/3)/16 times 15 (1 - ee^2)/(2 J): by
    Newton's method from above, where the cubic is convex.
    """
    length = np.full_like(np.asarray(a, dtype=float), 10.0)
    for _ in range(30):
        value = (factor * length + 1 - factor) * length**2 - a
        slope = (3 * factor * length + 2 * (1 - factor)) * length
        length = np.clip(length - value / slope, 1, 10)
    return length


def inverse_contact_value(nu, nu_m: float, pole: float):
    """1/G = 1/(nu g0) of solid fractions, zero at and above `pole`.

    g0 = (1 - w) CS + 2 w/(pole - nu), w = ((nu - nu_m)/(pole - nu_m))^2 above nu_m, CS Carnahan and
    Starling's.
    """
    nu = np.asarray(nu, dtype=float)
    carnahan_starling = (2 - nu) / (2 * (1 - nu) ** 3)
    w = np.clip((nu - nu_m) / (pole - nu_m), 0, 1) ** 2
    gap = np.maximum(pole - nu, 0)
    return gap / (nu * (gap * (1 - w) * carnahan_starling + 2 * w))
