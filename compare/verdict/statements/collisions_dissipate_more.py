import numpy as np

from compare.mapping.reductions import example_run
from compare.verdict.statements import Finding, loss, statement


@statement(
    text="Collisions dissipate significantly more than plastic flow",
    source="Figure 6",
    unit="Γc : Γq",
    bound="> 1, losses and all",
    order=3,
)
def collisions_dissipate_more(run):
    """Energy dissipated by collisions over that by plastic flow, both until the end. It holds only
    if collisions exceed plastic flow together with the size of all numerical losses: then no joule
    that the numerics ate could turn it round.
    """
    collisional, plastic = (
        run.joules(f"dissipated_{kind}")[-1] / run.released() for kind in ("collisional", "plastic")
    )
    end = run.energy_tau()[-1]
    lost = abs(loss(run, end))
    words = f"{100 * collisional:.1f} % against {100 * plastic:.1f} % of the energy released"
    return Finding(
        collisional / plastic if plastic else np.inf, collisional > plastic + lost, end, words
    )


def dissipating(collisional, plastic, lost):
    t = np.linspace(0.0, 5.0, 51)
    return example_run(
        engine="mpm",
        energy={
            "time": t,
            "potential": 2.0 - t / 5.0,
            "kinetic": 0.0 * t,
            "unaccounted": lost * t / 5.0,
            "dissipated_collisional": collisional * t / 5.0,
            "dissipated_plastic": plastic * t / 5.0,
        },
    )


def holding():
    return dissipating(0.6, 0.35, 0.05)


def failing():
    """More than plastic flow alone, but not if the losses had been plastic."""
    return dissipating(0.45, 0.40, 0.15)
