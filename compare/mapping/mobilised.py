"""Where a collapsing column slides and where it flows: the zones of [Ceccato2019, Figures 3 to 5],
defined at the points.

At an instant a point is mobilised when it is faster than a hundredth of √(gH). The sliding surface
is where mobilised points meet those at rest, the base where they meet the floor; both are layers as
thick as a shear band, five grain diameters, or two cells where the grid is too coarse for that.
What moves elsewhere is the inside of the mobilised mass.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from compare.mapping.runs import Run

STATIC, SURFACE, INSIDE = 0, 1, 2
WORDS = ("at rest", "sliding surface and base", "inside the mobilised mass")
SLOW = 0.01  # of sqrt(g H)
BAND = 5.0  # grain diameters


def thickness(run: Run) -> float:
    """Of the layers [m]."""
    return max(BAND * run.diameter, 2.0 * run.case["mpm.cell_size"])


def zones(run: Run, frame: int, layer: float) -> np.ndarray:
    """(N,) of STATIC, SURFACE, INSIDE, with layers of thickness `layer` [m]."""
    cloud = run.clouds[frame]
    x = cloud.x[:, :2]
    mobilised = np.linalg.norm(cloud.v, axis=1) > SLOW * np.sqrt(
        run.case["geometry.gravity"] * run.height
    )
    zone = np.where(mobilised, INSIDE, STATIC)
    zone[mobilised & (x[:, 1] < layer)] = SURFACE
    if mobilised.any() and not mobilised.all():
        for kind, other in ((mobilised, ~mobilised), (~mobilised, mobilised)):
            distance, _ = cKDTree(x[other]).query(x[kind], distance_upper_bound=layer)
            zone[np.flatnonzero(kind)[distance < layer]] = SURFACE
    return zone


@dataclass(frozen=True)
class Share:
    """Of all that an account dissipates: `found` in each zone, and `even`, what the sliding surface
    and base would hold if every instant's dissipation were spread evenly over the mass that moves
    or touches what moves.
    """

    found: np.ndarray  # (3,)
    even: float

    @property
    def concentration(self) -> float:
        """How many times the specific dissipation of the layers exceeds that of an even spread."""
        return float(self.found[SURFACE] / self.even) if self.even > 0.0 else float("nan")


def shares(run: Run, account: str, layer: float) -> Share:
    """Where `account` (a record of the points, J/kg, accumulated) is dissipated: its increments
    from frame to frame, each booked where its point is at the later one.
    """
    gone, even, before = np.zeros(3), 0.0, None
    for frame, cloud in enumerate(run.clouds):
        values = cloud.state[account] * cloud.mass
        if before is not None:
            zone, increment = zones(run, frame, layer), values - before
            gone += [increment[zone == k].sum() for k in (STATIC, SURFACE, INSIDE)]
            mass = [cloud.mass[zone == k].sum() for k in (SURFACE, INSIDE)]
            even += increment.sum() * mass[0] / sum(mass) if sum(mass) > 0.0 else 0.0
        before = values
    total = gone.sum()
    return (
        Share(gone / total, even / total)
        if total > 0.0
        else Share(np.full(3, np.nan), float("nan"))
    )
