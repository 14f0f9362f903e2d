"""A smooth base on which the grains roll."""

from compare.mapping.contacts import base_friction
from compare.mapping.runs import Run
from compare.verdict.findings import Finding, Severity, check

SHARE = 0.8


def rolling(run: Run) -> float | None:
    """The friction that grains feel which roll on the smooth base of their case, where the
    continuum can only slide; None where they do not.
    """
    walls = run.case["walls"]
    if walls["base"] != "coulomb":
        return None
    found = base_friction(run)
    return found if found < SHARE * walls["base_friction"] else None


@check(order=88)
def base_rolls(c, metrics):
    """Friction of a smooth base where grains move along it, tangential over normal forces, as a
    share of the case's: grains may roll where the continuum can only slide, and then the two do not
    stand on the same floor.
    """
    given, found = c.dem[0].case["walls.base_friction"], rolling(c.dem[0])
    if found is not None:
        yield Finding(
            Severity.CAUTION,
            f"The base exerts a friction of {found:.2f} on grains that move along it, not the "
            f"{given:g} of the case: they roll, and the continuum can only slide.",
            f"Give the continuum that friction (--set walls.base_friction={found:.2f}) to judge "
            "its law, or choose a glued base.",
            found / given,
            SHARE,
            unit="of walls.base_friction",
            reason="a fifth of the friction moves a low column's run-out by as much as the margin",
            of="dem",
        )
