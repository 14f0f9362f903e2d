import numpy as np

from compare.metrics import metric
from compare.mapping.reductions import example_run, wasserstein

DIRECTIONS = 32


@metric(
    unit="L0",
    source=(
        "sliced Wasserstein distance (Rabin et al. 2011), scaled so that a shift gives its length"
    ),
    of_pair=True,
    margin="compare.margin_distance",
)
def wasserstein_plane(mpm, dem):
    """Sliced Wasserstein distance of the two final mass distributions in the plane, over L0: the
    mean over 32 directions of the one-dimensional distance of the projections, times pi/2, so that
    a rigid shift gives the shift.
    """
    a, b = mpm.clouds[-1], dem.clouds[-1]
    angles = (np.arange(DIRECTIONS) + 0.5) * np.pi / DIRECTIONS
    sliced = [
        wasserstein(a.x[:, :2] @ n, b.x[:, :2] @ n, a.mass, b.mass)
        for n in np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    ]
    return float(np.mean(sliced)) * np.pi / 2.0 / dem.length


def example():
    # A shift of length 0.5; 32 directions give its mean |cos| to 4e-4 (midpoint rule).
    x = np.random.default_rng(1).uniform(size=(1, 50, 3))
    return (example_run(x=x), example_run(x=x + [0.3, 0.4, 0.0])), 0.5, 5e-4
