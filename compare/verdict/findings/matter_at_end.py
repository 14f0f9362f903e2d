"""Matter where the scene ends."""

from compare.mapping.runs import Run
from compare.verdict.findings import SIDE, Finding, Severity, check, sides, worst

SHARE = 0.005


def at_end(run: Run) -> float:
    """Largest share of the mass, over the frames, within a cell (of grains: a diameter) of the far
    end of the floor, beyond it, or more than that below the base.
    """
    reach = run.case["mpm.cell_size"] if run.engine == "mpm" else run.diameter
    end, most = run.case["geometry.floor_length"], 0.0
    for cloud in run.clouds:
        gone = (cloud.x[:, 0] > end - reach) | (cloud.x[:, 1] < -reach)
        most = max(most, float(cloud.mass[gone].sum() / cloud.mass.sum()))
    return most


@check(order=20)
def matter_at_end(c, metrics):
    """Mass at the far end of the floor, beyond it or below the base, at any frame: the continuum is
    dammed there and grains fall off, so what comes of it is no column on a floor.
    """
    for engine, runs in sides(c):
        share, which = worst(runs, at_end)
        if share > 0.0:
            yield Finding(
                Severity.INVALID if share > SHARE else Severity.CAUTION,
                f"{100 * share:.1f} % of the mass of the {SIDE[engine]} reached the end of the "
                f"scene{which}: it is dammed there, or has fallen off.",
                "Set a longer geometry.floor_length.",
                share,
                SHARE,
                reason="what the outermost figure, run_out, leaves aside as stray",
                of=engine,
            )
