"""The deposit that a run leaves, or the discharge of its silo, in a process of its own.

python3 -m compare.study.deposit CASE TASK -o RESULT.json
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from cases.case import Case, load
from cases.scenes import is_silo
from cases.scratch import temporary
from cases.stages import Stage, run_stages
from compare.mapping.runs import Run, seconds_of
from compare.metrics.discharge import discharge
from compare.metrics.final_height import final_height
from compare.study import job
from compare.study.figures import at_end
from compare.study.recipe import Recipe
from compare.verdict import siblings
from dem_reference.edge import SHARE

DEFINITIONS = {
    "run_out": f"(x - L0)/L0 at the end, x where the deposit, followed outwards, first holds less "
    f"than {SHARE:g} of a close-packed monolayer of grains, on the mapped field",
    "height": "height of the free surface at the end over L0 (metric final_height)",
}
DEFINITIONS_SILO = {
    "discharge": "mass that leaves per time and per length of the slot, over rho_b sqrt(g) D^1.5, "
    "D the width of the slot (metric discharge)"
}


def definitions(scene: Case) -> dict[str, str]:
    """The figures of a scene's runs, and what each is."""
    return DEFINITIONS_SILO if is_silo(scene["geometry"]) else DEFINITIONS


def edge(x: np.ndarray, solid: np.ndarray, diameter: float) -> float:
    """Where a deposit ends [m], that holds `solid` (n,) [m3/m2] at x (n,): as published, where
    single grains ahead of it do not count.
    """
    monolayer = np.pi / 6.0 * diameter / (np.sqrt(3.0) / 2.0)
    thin = np.flatnonzero(solid < SHARE * monolayer)
    if not len(thin):
        return float(x[-1])
    k = thin[0]
    if k == 0:
        return 0.0
    share = (solid[k - 1] - SHARE * monolayer) / (solid[k - 1] - solid[k])
    return float(x[k - 1] + share * (x[k] - x[k - 1]))


def of(scene: Path, recipe: Recipe) -> dict[str, float]:
    """Figures of `definitions`, end [sqrt(H/g)] and processor time of the engine [s]."""
    with temporary() as folder:
        result = folder / "run.h5"
        run_stages([Stage(recipe.label, recipe.words(scene, result))], quiet=True)
        run = at_end(result)
        return {
            **(discharged(run) if is_silo(run.case["geometry"]) else deposited(run)),
            "until": float(run.tau()[-1]),
            "cpu_seconds_engine": seconds_of(run, "cpu_seconds_engine"),
        }


def deposited(run: Run) -> dict[str, float]:
    """Run-out and height [L0]."""
    grid = run.fields.grid
    solid = run.fields["solid_fraction"][-1].sum(axis=0) * grid.spacing
    return {
        "run_out": edge(grid.x, solid, run.diameter) / run.length - 1.0,
        "height": final_height(run),
    }


def discharged(run: Run) -> dict[str, float]:
    return {"discharge": discharge(run)}


def make(scene: Path, task: dict) -> dict:
    """Of a run of the continuum with what its numerics may move each figure by."""
    recipe = Recipe.of(task)
    found = of(scene, recipe)
    if recipe.engine == "mpm":
        others = [
            of(scene, replace(recipe, sets=(*recipe.sets, *more)))
            for more in siblings.overrides(load(scene, recipe.sets)).values()
        ]
        for name in definitions(load(scene, recipe.sets)):
            found[f"{name}_numerical"] = siblings.bar(*(found[name] - one[name] for one in others))
    return found


if __name__ == "__main__":
    sys.exit(job.run("compare.study.deposit", __doc__, make))
