"""Verdicts: is the continuum equivalent to the grains, within the case's margin and given the
grains' scatter?

Two one-sided tests at alpha = 0.05 (TOST): equivalent when the 90 % confidence interval of the
difference of means lies inside (-margin, margin) (Schuirmann 1987; Welch's degrees of freedom). Not
finding a difference is not agreement, so an interval that is neither inside nor outside the margin
is "unresolved". A single pair whose packings' scatter nobody knows is not tested: then only whether
the difference is within the margin is said, in other words.

Where the scatter s of n packings is stored, a single packing x stands for their mean with x - mean
~ N(0, s^2): the interval is x +- t(n - 1) s, wider than that of the mean of n by sqrt(n).

What the numerics may be off by widens every interval on both sides. It is added, not squared: it is
a bound of an error that every repetition makes alike, no random variable.
"""

from dataclasses import dataclass, replace

import numpy as np

from cases import student

AGREE, DIFFER, UNRESOLVED = "agree", "differ", "unresolved"
WITHIN, OUTSIDE = "within margin", "outside margin"
UNDECIDABLE = "not decidable"


@dataclass(frozen=True)
class Scatter:
    """Standard deviation of a metric between the packings of an ensemble that is stored."""

    deviation: float
    packings: int


@dataclass(frozen=True)
class Verdict:
    word: str
    difference: float  # of means
    half_width: float  # of its 90 % confidence interval; NaN without scatter
    margin: float
    numerical: float = 0.0  # what the numerics add to the half-width

    def decided_by(self, loss: float) -> "Verdict":
        """The verdict on an energy where the numerics have taken `loss` of it: not decidable where
        that is more than the margin, unless the loss cannot be what the difference stems from.
        """
        half = 0.0 if np.isnan(self.half_width) else self.half_width
        clear = abs(self.difference) - half - self.numerical - abs(loss) > self.margin
        undecided = abs(loss) > self.margin and not clear
        return replace(self, word=UNDECIDABLE) if undecided else self


def confidence_half_width(
    a: np.ndarray, b: np.ndarray, scatter: Scatter | None = None, confidence: float = 0.90
) -> float:
    """Half-width of the interval of mean(a) - mean(b), Welch; a sample of one is a deterministic
    value without scatter, unless it is b and the scatter of what it is one of is known.

    NaN when there is no scatter to estimate from.
    """
    variances, freedoms = [], []
    for sample in (a, b):
        if len(sample) > 1:
            variances.append(np.var(sample, ddof=1) / len(sample))
            freedoms.append(len(sample) - 1)
    if scatter and len(b) == 1:
        variances.append(scatter.deviation**2)
        freedoms.append(scatter.packings - 1)
    if not variances:
        return float("nan")
    total = sum(variances)
    if total == 0.0:
        return 0.0
    freedom = 1.0 / sum(
        (v / total) ** 2 / n for v, n in zip(variances, freedoms)
    )  # shares: squares of small numbers vanish
    return float(student.quantile(0.5 + 0.5 * confidence, freedom) * np.sqrt(total))


def equivalence(
    mpm, dem, margin: float, scatter: Scatter | None = None, numerical: float = 0.0
) -> Verdict:
    """Verdict on samples of one metric, one value per run of either engine."""
    mpm, dem = np.atleast_1d(np.asarray(mpm, dtype=float)), np.atleast_1d(
        np.asarray(dem, dtype=float)
    )
    difference = float(mpm.mean() - dem.mean())
    half = confidence_half_width(mpm, dem, scatter)
    tested = not np.isnan(half)
    width = numerical + (half if tested else 0.0)
    if not np.isfinite(difference):
        word = UNRESOLVED
    elif abs(difference) + width <= margin:
        word = AGREE if tested else WITHIN
    elif abs(difference) - width > margin:
        word = DIFFER if tested else OUTSIDE
    else:
        word = UNRESOLVED
    return Verdict(word, difference, half, margin, numerical)


def distance(values, margin: float, numerical: float = 0.0) -> Verdict:
    """Verdict on a metric of pairs that is a distance (zero is agreement): one value per run of the
    ensemble.
    """
    return equivalence(values, [0.0], margin, numerical=numerical)


def overall(words: list[str]) -> str:
    """One word for the whole comparison: agreement takes every metric, one clear difference is
    enough to differ; a metric that was not tested leaves "within margin".
    """
    if not words:
        return UNRESOLVED
    for word in (DIFFER, OUTSIDE, UNRESOLVED, UNDECIDABLE, WITHIN):
        if word in words:
            return word
    return AGREE
