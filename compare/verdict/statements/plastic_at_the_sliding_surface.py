import numpy as np

from compare.mapping.mobilised import INSIDE, STATIC, SURFACE, shares, thickness, zones
from compare.mapping.reductions import example_run
from compare.verdict.statements import Finding, statement


@statement(
    text="Plastic dissipation mainly occurs at the sliding surface and the base",
    source="Figure 5, section 5",
    unit="of the plastic dissipation",
    bound="> 0.5, and more than an even spread",
    order=8,
)
def plastic_at_the_sliding_surface(run):
    """Share of the plastic dissipation in the layers where mobilised mass meets mass at rest or the
    floor (a point is mobilised when faster than 0.01 √(gH); layers of five grain diameters, or two
    cells where that is more). More than an even spread: of every instant's dissipation over the
    mass that moves or touches what moves.
    """
    layer = thickness(run)
    found = shares(run, "plastic_dissipation", layer)
    halved, doubled = (
        shares(run, "plastic_dissipation", factor * layer).found[SURFACE] for factor in (0.5, 2.0)
    )
    share = found.found[SURFACE]
    words = (
        f"{found.concentration:.2g} times an even spread, which would put {found.even:.2f} there; "
        f"inside {found.found[INSIDE]:.2f}, at rest {found.found[STATIC]:.2f}; {halved:.2f} and "
        f"{doubled:.2f} in layers half and twice as thick"
    )
    return Finding(share, bool(share > 0.5 and found.concentration > 1.0), run.tau()[-1], words)


def sliding(account, where):
    """A block of 40 x 40 points on a grain lattice whose upper right half slides over the lower
    left; `account` is dissipated evenly over the points of the zones `where`.
    """
    centres = (np.arange(40) + 0.5) / 40
    x, y = (a.ravel() for a in np.meshgrid(centres, centres))
    cloud = np.stack([x, y, 0.0 * x], axis=-1)
    speed = np.where(x + y > 1.0, 0.5, 0.0)
    frames = 3
    t = np.linspace(0.0, 2.0, frames)
    run = example_run(
        x=np.repeat(cloud[None], frames, axis=0),
        v=np.repeat((speed[:, None] * [1.0, -1.0, 0.0])[None], frames, axis=0),
        time=t,
        energy={"time": t, "potential": 2.0 - t, "kinetic": 0.0 * t},
        engine="mpm",
        diameter=0.025,
    )
    chosen = np.isin(zones(run, 0, thickness(run)), where).astype(float)
    for k, one in enumerate(run.clouds):
        one.state[account] = k * chosen
    return run


def holding():
    return sliding("plastic_dissipation", [SURFACE])


def failing():
    """Spread evenly over all that moves."""
    return sliding("plastic_dissipation", [SURFACE, INSIDE])
