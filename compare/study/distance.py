"""How far runs are from one another, and what they cost, told from their signatures
(compare/study/signature.py).
"""

import numpy as np

from cases.case import Case
from compare.metrics import all_metrics
from compare.study.signature import HISTORY, digits, expand
from compare.verdict.comparison import pair

WORDS = {
    "run_out": "run-out (99.5 % of the mass)",
    "deposit": "deposit (Wasserstein distance along x)",
    "kinetic": "kinetic energy over time",
    "dissipation": "split of the dissipation",
    "combined": "combined (root mean square of the four)",
}


def cost(signature: dict) -> float:
    """Processor seconds per sqrt(H/g) simulated; the grains' packing is not in it."""
    return signature["cpu_seconds"] / signature["tau"][-1]


def mean(signatures: list[dict], scene: Case) -> dict:
    """The mean of an ensemble: of the quantile functions (the barycentre in Wasserstein's distance)
    and of the histories scaled to one mass.
    """
    runs = [expand(signature, scene) for signature in signatures]
    pair([], runs)
    tau = max((signature["tau"] for signature in signatures), key=lambda times: times[-1])
    history = {
        name: digits(
            np.mean([np.interp(tau, run.energy_tau(), run.joules(name)) for run in runs], axis=0)
        )
        for name in HISTORY
        if all(name in run.energy for run in runs)
    }
    return (
        signatures[0]
        | history
        | {"tau": tau, "x": digits(np.mean([signature["x"] for signature in signatures], axis=0))}
    )


def errors(signature: dict, reference: dict, scene: Case) -> dict[str, float]:
    """How far a run is from a reference, each relative: the run-out to the final length, the
    deposit to L0, the kinetic energy to the area under the reference's, the dissipation to the
    energy it releases; and their root mean square.
    """
    run, other = expand(signature, scene), expand(reference, scene)
    pair([run], [other])
    metrics = all_metrics()
    run_out = metrics["run_out"]
    found = {
        "run_out": abs(run_out(run) - run_out(other)) / (1.0 + run_out(other)),
        "deposit": metrics["wasserstein_x"](run, other),
        "kinetic": metrics["kinetic_energy_distance"](run, other),
        "dissipation": metrics["dissipation_split"](run, other),
    }
    return {name: float(value) for name, value in found.items()} | {
        "combined": float(np.sqrt(np.mean(np.square(list(found.values())))))
    }
