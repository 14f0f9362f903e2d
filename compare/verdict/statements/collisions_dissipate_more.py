import numpy as np

from compare.mapping.reductions import example_run
from compare.verdict.statements import Finding, loss, statement


@statement(
    text="Significantly more is dissipated in regime 4 (collisions) than by plastic flow",
    source="Figure 6",
    unit="regime 4 : plastic",
    bound="> 1, losses and all",
    order=3,
)
def collisions_dissipate_more(run):
    """Energy dissipated in regime 4 over that by plastic flow, both until the end. It holds only
    if the first exceeds the second together with the size of all numerical losses: then no joule
    that the numerics ate could turn it round.
    """
    fluid, plastic = (
        run.joules(f"dissipated_{kind}")[-1] / run.released() for kind in ("regime_4", "plastic")
    )
    end = run.energy_tau()[-1]
    lost = abs(loss(run, end))
    words = f"{100 * fluid:.1f} % against {100 * plastic:.1f} % of the energy released"
    return Finding(fluid / plastic if plastic else np.inf, fluid > plastic + lost, end, words)


def dissipating(fluid, plastic, lost):
    t = np.linspace(0.0, 5.0, 51)
    return example_run(
        engine="mpm",
        energy={
            "time": t,
            "potential": 2.0 - t / 5.0,
            "kinetic": 0.0 * t,
            "unaccounted": lost * t / 5.0,
            "dissipated_regime_4": fluid * t / 5.0,
            "dissipated_plastic": plastic * t / 5.0,
        },
    )


def holding():
    return dissipating(0.6, 0.35, 0.05)


def failing():
    """More than plastic flow alone, but not if the losses had been plastic."""
    return dissipating(0.45, 0.40, 0.15)
