"""Verdicts: is the continuum equivalent to the grains, within the case's margin and given the
grains' scatter?

Two one-sided tests at alpha = 0.05 (TOST): equivalent when the 90 % confidence interval of the
difference of means lies inside (-margin, margin) (Schuirmann 1987; Welch's degrees of freedom). Not
finding a difference is not agreement, so an interval that is neither inside nor outside the margin
is "unresolved". A single pair has no scatter: then only whether the difference is within the margin
is said, in other words.
"""

from dataclasses import dataclass

import numpy as np
from scipy import stats

AGREE, DIFFER, UNRESOLVED = "agree", "differ", "unresolved"
WITHIN, OUTSIDE = "within margin", "outside margin"


@dataclass(frozen=True)
class Verdict:
    word: str
    difference: float  # of means
    half_width: float  # of its 90 % confidence interval; NaN for a single pair
    margin: float


def confidence_half_width(a: np.ndarray, b: np.ndarray, confidence: float = 0.90) -> float:
    """Half-width of the interval of mean(a) - mean(b), Welch; a sample of one is a deterministic
    value without scatter.

    NaN when neither sample has scatter to estimate.
    """
    variances, freedoms = [], []
    for sample in (a, b):
        if len(sample) > 1:
            variances.append(np.var(sample, ddof=1) / len(sample))
            freedoms.append(len(sample) - 1)
    if not variances:
        return float("nan")
    total = sum(variances)
    if total == 0.0:
        return 0.0
    freedom = 1.0 / sum(
        (v / total) ** 2 / n for v, n in zip(variances, freedoms)
    )  # shares: squares of small numbers vanish
    return float(stats.t.ppf(0.5 + 0.5 * confidence, freedom) * np.sqrt(total))


def equivalence(mpm, dem, margin: float) -> Verdict:
    """Verdict on samples of one metric, one value per run of either engine."""
    mpm, dem = np.atleast_1d(np.asarray(mpm, dtype=float)), np.atleast_1d(
        np.asarray(dem, dtype=float)
    )
    difference = float(mpm.mean() - dem.mean())
    half = confidence_half_width(mpm, dem)
    if not np.isfinite(difference):
        word = UNRESOLVED
    elif np.isnan(half):
        word = WITHIN if abs(difference) <= margin else OUTSIDE
    elif abs(difference) + half <= margin:
        word = AGREE
    elif abs(difference) - half > margin:
        word = DIFFER
    else:
        word = UNRESOLVED
    return Verdict(word, difference, half, margin)


def distance(values, margin: float) -> Verdict:
    """Verdict on a metric of pairs that is a distance (zero is agreement): one value per run of the
    ensemble.
    """
    return equivalence(values, [0.0], margin)


def overall(words: list[str]) -> str:
    """One word for the whole comparison: agreement takes every metric, one clear difference is
    enough to differ.
    """
    if not words:
        return UNRESOLVED
    for word in (DIFFER, OUTSIDE, UNRESOLVED):
        if word in words:
            return word
    return AGREE if AGREE in words else WITHIN
