import numpy as np

from cases.scenes import is_silo
from compare.mapping.reductions import example_run
from compare.metrics import metric

SHARES = (0.15, 0.75)  # of what leaves in all, between which the rate is steady


@metric(unit="-", source="Beverloo et al. 1961; of a slot, Nedderman 1992")
def discharge(run):
    """Mass that leaves a silo per time and per length of its slot, over rho_b sqrt(g) D^(3/2) with
    the width D of the slot and the bulk density rho_b at the start: the slope, by least squares,
    while 15 to 75 % of what leaves has left. Undefined without an orifice.
    """
    geometry = run.case["geometry"]
    if not is_silo(geometry):
        return float("nan")
    left = np.array([below(cloud, geometry["fall"]) for cloud in run.clouds])  # [kg]
    steady = (left >= SHARES[0] * left[-1]) & (left <= SHARES[1] * left[-1])
    if steady.sum() < 3 or left[-1] <= 0.0:
        return float("nan")
    rate = np.polyfit(run.time[steady], left[steady], 1)[0] / geometry["thickness"]  # [kg/(m s)]
    bulk = run.case["grains.density"] / (1.0 + run.case["initial.void_ratio"])
    width = 2.0 * geometry["orifice"]  # the left wall is the plane of symmetry
    return float(2.0 * rate / (bulk * np.sqrt(geometry["gravity"]) * width**1.5))


def below(cloud, height: float) -> float:
    """Mass of what lies lower than a height [m], in kg."""
    return float(cloud.mass[cloud.x[:, 1] < height].sum())


def example():
    """Of eight points of 1 kg one leaves each second by half a slot of 1 m; their bulk density is
    0.5 kg/m3.
    """
    x = np.zeros((9, 8, 3))
    for frame in range(9):
        x[frame, :, 1] = np.where(np.arange(8) < frame, 0.5, 2.0)
    run = example_run(x=x, time=np.arange(9.0), silo={"orifice": 0.5, "fall": 1.0})
    return (run,), 4.0, 1e-9
