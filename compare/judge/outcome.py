"""Whether the bias of a law in the grains' flow foretells what its collapse is off by.

Each law runs each scene; its deviations from the grains stand beside its overall bias of mu_D. Over
all of them a straight line is fitted, and every scene is foretold by a line through the others.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from compare.judge import trial as judged
from compare.judge.trial import Trial
from compare.mapping.runs import open_run
from compare.metrics import all_metrics
from compare.study import reference, sweep
from compare.study.distance import cost, errors
from compare.study.frontier import grain_cost
from compare.study.recipe import Recipe
from compare.study.signature import expand
from compare.verdict.findings.base_rolls import rolling

# What is foretold.
WORDS = {
    "run_out_95": "run-out, 95 % of the mass, over the final length",
    "final_height": "height",
    "centre_of_mass_x": "centre of mass along x",
}
HEADLINES = tuple(WORDS)


def headlines(signature: dict, scene) -> dict[str, float]:
    """The HEADLINES of a signature (compare/study/signature.py), in L0."""
    metrics, run = all_metrics(), expand(signature, scene)
    told = {name: float(metrics[name](run)) for name in ("run_out_95", "centre_of_mass_x")}
    return told | {"final_height": signature["height"]}


def of_scene(trial: Trial, options) -> pd.DataFrame:
    """A row per law: scene, law, bias with its range, whether the grains roll on their base, and
    the deviations from the grains, each relative: of the run-out to the final length, of height and
    centre of mass to the grains' own; then the errors of compare/study/distance.py and how many
    times cheaper than the grains it is. NaN of a law whose run fails.
    """
    scene = trial.scene
    softness = scene["dem.young_modulus"] or scene["grains.young_modulus"]
    stiffness = f"mpm.young_modulus={softness:g}"
    recipes = [
        Recipe("mpm", (*options.overrides, *law.candidate.words, stiffness), law.label)
        for law in trial.laws
    ]
    found = sweep.run_recipes(scene, recipes, options)
    grains = reference.of_runs(trial.files, scene)
    told = [headlines(member, scene) for member in grains["members"]]
    mean = {name: float(np.mean([one[name] for one in told])) for name in HEADLINES}
    rolls = rolling(open_run(trial.files[0])) is not None
    dear = grain_cost(grains)
    table = judged.overall(trial).set_index("law")
    rows = []
    for law, point in zip(trial.laws, found):
        line = table.loc[law.label]
        row = {"scene": scene.path.parent.name, "law": law.label, "bias": line["bias of μ_D"]}
        row |= {"from": line["from"], "to": line["to"], "rolls": rolls}
        if point["status"] == "ok":
            own = headlines(point, scene)
            for name in HEADLINES:
                base = mean[name] + (1.0 if name == "run_out_95" else 0.0)
                row[name] = (own[name] - mean[name]) / base
            off = errors(point, grains["mean"], scene)
            row |= {f"error_{name}": value for name, value in off.items() if name != "combined"}
            row["cheaper"] = dear / cost(point)
        rows.append(row)
    return pd.DataFrame(rows)


@dataclass(frozen=True)
class Line:
    """deviation = at_none + slope * bias."""

    at_none: float
    slope: float

    @classmethod
    def through(cls, bias: np.ndarray, deviation: np.ndarray) -> "Line":
        slope, at_none = np.polyfit(bias, deviation, 1)
        return cls(float(at_none), float(slope))

    def at(self, bias: np.ndarray) -> np.ndarray:
        return self.at_none + self.slope * bias


def regression(table: pd.DataFrame) -> pd.DataFrame:
    """Of the scenes in which both sides stand on the same floor, a row per headline: the line
    through all, the share of the variance it explains, and root mean squares of what is left: of
    all; of each scene foretold by the others; and of the same by the mean of the others, which
    knows no bias (the control). NaN for those with one scene.
    """
    rows = []
    for name in HEADLINES:
        known = table[np.isfinite(table[name]) & ~table["rolls"].astype(bool)]
        bias, deviation = known["bias"].to_numpy(), known[name].to_numpy()
        line = Line.through(bias, deviation)
        left = deviation - line.at(bias)
        foretold, blind = [], []
        for scene in known["scene"].unique():
            here = (known["scene"] == scene).to_numpy()
            if here.all():
                continue
            others = Line.through(bias[~here], deviation[~here])
            foretold.append(deviation[here] - others.at(bias[here]))
            blind.append(deviation[here] - deviation[~here].mean())
        rows.append(
            {
                "headline": name,
                "slope": line.slope,
                "at no bias": line.at_none,
                "explained": 1.0 - left.var() / deviation.var(),
                "left": rms(left),
                "foretold": rms(np.concatenate(foretold)) if foretold else np.nan,
                "by the mean": rms(np.concatenate(blind)) if blind else np.nan,
                "runs": len(known),
            }
        )
    return pd.DataFrame(rows)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
