"""Runs of the studies of a chute: which there are, and their result files, which are kept."""

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from cases import case, content
from cases.errors import CaseError
from cases.programs import kept
from compare.study.recipe import Recipe
from dem_reference.content import ensemble_key

ANGLES = (24.0, 26.0, 28.0)
DEPTHS = (8.0, 12.0, 18.0)  # of grains at the case's inclination [d]
SEEDS = 3  # packings of the grains, at the case's inclination and depth
LAWS = {  # with the card that its constants are taken from
    "drucker_prager": "dem_mu05",
    "mu_i": "",
    "solid_fluid": "dem_mu05",
    "contact_share": "contact_mu05",
}
LONGER = 2.0  # times the case's time, for the grains, whose means need it
# Of the case's time, for the continuum: before points of the fastest flow leave their rows.
SHORTER = 0.75


@dataclass(frozen=True)
class Task:
    recipe: Recipe
    law: str
    inclination: float
    height: float  # [d]


def steady(scene: case.Case, only: str = "", seeds: int = SEEDS) -> list[Task]:
    """Grains of every angle and depth, those of the case itself of `seeds` packings; and each law
    at every angle.
    """
    d, own = scene["grains.diameter"], scene["geometry.inclination"]
    layer = scene["geometry.height"] / d
    places = [(angle, layer, 1) for angle in ANGLES]
    places += [(own, layer, seed) for seed in range(2, seeds + 1)]
    places += [(own, depth, 1) for depth in DEPTHS if abs(depth - layer) > 0.01]
    out = []
    for angle, depth, seed in places:
        # times are told in sqrt(H/g): frames stay as far apart, and a layer takes the longer the
        # deeper it is
        sets = [f"geometry.inclination={angle}"]
        sets += [f"time.maximum={float(LONGER * scene['time.maximum'])!r}"]
        if abs(depth - layer) > 0.01:
            interval = scene["time.frame_interval"] * (layer / depth) ** 0.5
            sets += [f"geometry.height={float(depth * d)!r}", f"time.frame_interval={interval:.6g}"]
        out.append(Task(Recipe("dem", tuple(sets), seed=seed), "", angle, depth))
    for law in LAWS:
        for angle in ANGLES:
            sets = [f"geometry.inclination={angle}", *of_law(law)]
            sets += [
                f"time.maximum={float(SHORTER * scene['time.maximum'])!r}",
                "time.frame_interval=2.0",
            ]
            out.append(Task(Recipe("mpm", tuple(sets)), law, angle, layer))
    return [task for task in out if only in ("", task.recipe.engine)]


def of_law(law: str) -> list[str]:
    """What a case is told to have it."""
    return [f"material.law={law}", f"material.card={LAWS[law]}"]


def result(scene: case.Case, task: Task) -> Path:
    """The run's file, made unless it is there. Raises CaseError with the engine's words."""
    here, seed = case.load(scene.path, task.recipe.sets), task.recipe.seed
    of_grains = task.recipe.engine == "dem"
    made = [ensemble_key(here), seed] if of_grains else [here.resolved, content.of_continuum(), 1]
    path = kept("studies", "chute", f"{content.digest([task.recipe.engine, made])}.h5")
    if path.exists():
        return path
    path.parent.mkdir(parents=True, exist_ok=True)
    print(f"{task.recipe.engine} {task.recipe.label}, seed {seed}", file=sys.stderr, flush=True)
    done = subprocess.run(
        task.recipe.words(scene.path, path), capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise CaseError((done.stderr.strip().splitlines() or ["no word"])[-1])
    return path
