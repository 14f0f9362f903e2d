"""The cone of Lade and Duncan where flow is a simple shear."""

from math import asin, sin, sqrt


def simple_shear_ratio(stress_ratio: float) -> float:
    """s/p where isochoric plastic flow on the Lade-Duncan cone is a simple shear.

    eta = s/p = t (xy) + c diag(1, 1, -2). The flow direction dev(eta - eta.eta) has no zz part when
    t^2 = 3 c (1 + c), which leaves 3 c - 4 c^3 of the cone's
    (eta:eta)/2 - tr(eta^3)/3 = M^2/3 - 2 M^3/27: c = sin(asin(M^2/3 - 2 M^3/27)/3).
    """
    c = sin(asin(stress_ratio**2 / 3 - 2 * stress_ratio**3 / 27) / 3)
    return sqrt(3 * c * (1 + c))
