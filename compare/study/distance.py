"""How far runs are from one another, and what they cost, told from their signatures
(compare/study/signature.py).
"""

import numpy as np

from cases.case import Case
from compare.mapping import dissipation
from compare.metrics import all_metrics
from compare.study.signature import HISTORY, digits, expand, packed
from compare.verdict.comparison import pair

WORDS = {
    "run_out": "run-out (95 % of the mass)",
    "deposit": "deposit (Wasserstein distance along x)",
    "kinetic": "kinetic energy over time",
    "dissipation": "dissipation in place and time",
    "temperature": "granular temperature (of laws that have one)",
    "combined": "combined (root mean square of run-out, deposit, kinetic energy and dissipation)",
}


def cost(signature: dict) -> float:
    """Processor seconds of the engine's own steps per sqrt(H/g) simulated; NaN of a signature that
    was kept before result files told them from audit and output.
    """
    return signature.get("cpu_seconds_engine", np.nan) / signature["tau"][-1]


def mean(signatures: list[dict], scene: Case) -> dict:
    """The mean of an ensemble: of the quantile functions (the barycentre in Wasserstein's
    distance), of the histories scaled to one mass, and of the dissipation in each cell, where all
    know it, likewise.
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
    found = {"tau": tau, "x": digits(np.mean([one["x"] for one in signatures], axis=0))}
    places = [run.dissipation.times(run.mass_scale) for run in runs if run.dissipation]
    if len(places) == len(runs):
        found["dissipation"] = packed(dissipation.mean(places))
    kept = {name: value for name, value in signatures[0].items() if name != "dissipation"}
    return kept | history | found


def errors(signature: dict, reference: dict, scene: Case) -> dict[str, float]:
    """How far a run is from a reference, each relative: the run-out to the final length, the
    deposit to L0, the kinetic energy to the area under the reference's, the dissipation in place
    and time to L0, H and sqrt(H/g), the granular temperature to the area under the reference's; and
    the root mean square of the first four, which every law can be held against. What either of the
    two does not tell is NaN, and so is the root mean square of it: one of fewer errors would be
    another figure.
    """
    run, other = expand(signature, scene), expand(reference, scene)
    pair([run], [other])
    metrics = all_metrics()
    run_out = metrics["run_out_95"]
    found = {
        "run_out": abs(run_out(run) - run_out(other)) / (1.0 + run_out(other)),
        "deposit": metrics["wasserstein_x"](run, other),
        "kinetic": metrics["kinetic_energy_distance"](run, other),
        "dissipation": metrics["dissipation_distance"](run, other),
    }
    beside = {
        "temperature": metrics["granular_temperature_distance"](run, other),
        "combined": np.sqrt(np.mean(np.square(list(found.values())))),
    }
    return {name: float(value) for name, value in (found | beside).items()}
