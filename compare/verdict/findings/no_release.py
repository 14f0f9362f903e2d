"""Grains that release no energy: every figure over E0 hangs on it."""

import math

from compare.verdict.findings import Finding, Severity, check


@check(order=16)
def no_release(c, metrics):
    """Potential energy that the grains release, E0: where they gain it instead, they have not
    collapsed and no figure over E0 means anything; where they have one frame nobody knows it.
    """
    for run in c.dem:
        name = f"{run.name}.h5" if len(c.dem) > 1 else "The grains"
        if len(run.time) < 2:
            yield Finding(
                Severity.CAUTION,
                f"{name} have one frame: what needs time, or the energy released, is unknown.",
                "Figures of the end are of that frame; give the frames from the release on.",
                of="dem",
            )
        elif not run.released() > 0.0:
            yield Finding(
                Severity.INVALID,
                f"{name} gain {-run.released():.3g} J of potential energy in place of releasing "
                "it.",
                "See whether up is right (--up, --gravity).",
                None if math.isnan(run.released()) else run.released(),
                0.0,
                unit="J",
                reason="a column that collapses releases energy",
                of="dem",
            )
