from compare.mapping.mobilised import INSIDE, STATIC, SURFACE, shares, thickness
from compare.verdict.statements import Finding, statement
from compare.verdict.statements.plastic_at_the_sliding_surface import sliding


@statement(
    text="Dissipation in regime 4 (collisional) mainly occurs inside the mobilised mass",
    source="Figure 4",
    unit="of the dissipation in regime 4",
    bound="> 0.5",
    order=9,
)
def collisions_inside_the_mass(run):
    """Share of the dissipation in regime 4 in mobilised mass away from the sliding surface and
    the base, zones as for the plastic dissipation. That it lies in mobilised mass at all says
    less; the share in all that moves stands beside it.
    """
    layer = thickness(run)
    found = shares(run, "regime_4_dissipation", layer)
    halved, doubled = (
        shares(run, "regime_4_dissipation", factor * layer).found[INSIDE] for factor in (0.5, 2.0)
    )
    moving = shares(run, "regime_4_dissipation", 0.0).found[INSIDE]
    words = (
        f"{moving:.3f} in all that moves, layers included; an even spread over it would put "
        f"{1.0 - found.even:.2f} inside; sliding surface and base {found.found[SURFACE]:.2f}, at "
        f"rest {found.found[STATIC]:.2f}; {halved:.2f} and {doubled:.2f} inside layers half and "
        "twice as thick"
    )
    return Finding(found.found[INSIDE], bool(found.found[INSIDE] > 0.5), run.tau()[-1], words)


def holding():
    return sliding("regime_4_dissipation", [INSIDE])


def failing():
    return sliding("regime_4_dissipation", [SURFACE])
