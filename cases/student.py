"""Quantiles of Student's t, without SciPy: of what a first run installs it would be a fifth."""

from functools import lru_cache
from statistics import NormalDist

from mpmath import betainc, findroot


@lru_cache(maxsize=256)
def quantile(share: float, freedom: float) -> float:
    """The t that `share` of Student's distribution with `freedom` > 0 degrees of freedom, not
    always whole, lies below; 0.5 < `share` < 1.

    Its distribution function is 1 - I(f/(f + t^2); f/2, 1/2)/2, I the regularised incomplete beta
    function [Abramowitz and Stegun 1972, 26.7.1]. From the normal distribution's quantile, which
    is smaller, the secants of a function that is concave for t > 0 do not overshoot.
    """

    def below(t):
        return 1.0 - betainc(0.5 * freedom, 0.5, 0, freedom / (freedom + t * t), True) / 2.0

    start = NormalDist().inv_cdf(share)
    return float(findroot(lambda t: below(t) - share, start))
