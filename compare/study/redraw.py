"""Draws the pictures in cases/*/reference anew from the tables beside them; no engine runs.

    python3 -m compare.study.redraw
"""

import shutil
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from cases import case
from cases.errors import exit_code
from cases.programs import ROOT
from cases.scratch import temporary
from compare.study import frontier, published, recipe
from compare.study.charts import atlas as atlas_chart
from compare.study.charts import convergence as convergence_chart
from compare.study.charts import experiment as experiment_chart
from compare.study.charts import frontier as frontier_chart
from compare.study.charts import refinement as refinement_chart


def of_frontier(folder: Path, work: Path):
    """Each metric whose picture is kept."""
    points, grains = frontier.committed(folder.parent.name)
    points["message"] = points["message"].fillna("")
    for kept in sorted((folder / "frontier").glob("*.png")):
        kind, _, name = kept.stem.partition("_")
        if kind == "frontier":
            frontier_chart.draw(points, grains, name, work / kept.stem)
        else:
            frontier_chart.draw_numerical(points, name, work / kept.stem)
        yield kept


def of_atlas(folder: Path, work: Path):
    scene = case.load(folder.parent)
    planes = recipe.study(scene, "atlas")["plane"]
    table = pd.read_csv(folder / "atlas" / "boundaries.csv", comment="#")
    rows = [list(rows_of(table[table["plane"] == plane["name"]])) for plane in planes]
    atlas_chart.draw(planes, rows, scene, work / "atlas")
    yield folder / "atlas" / "atlas.png"
    trends = pd.read_csv(folder / "atlas" / "trends.csv", comment="#")
    atlas_chart.draw_trends(trends, work / "damping")
    yield folder / "atlas" / "damping.png"


def rows_of(plane: pd.DataFrame):
    """The rows of a plane of the atlas, as the bisection has them (compare/study/boundary.py)."""
    words = {"warnings": "none", "message": "", "command": ""}
    for value, runs in plane.fillna(words).groupby("across_value", sort=False):
        first = runs.iloc[0]
        good, bad = first["stable_to"], first["fails_from"]
        kept = runs[["value", "status", *words]].to_dict("records")
        yield value, {"runs": kept, "good": good, "bad": np.inf if np.isnan(bad) else bad}


def of_convergence(folder: Path, work: Path):
    table = pd.read_csv(folder / "convergence.csv", comment="#")
    convergence_chart.draw(table, work / "convergence")
    yield folder / "convergence.png"


def of_experiment(folder: Path, work: Path):
    """Case folders are called by their scene, whose geometry decides what is published of it."""
    table = pd.read_csv(folder / "experiment.csv", comment="#")
    geometry = case.load(folder.parent)["geometry.dimension"]
    experiment_chart.draw(table, published.of(geometry), work / "experiment")
    yield folder / "experiment.png"


def of_refinement(folder: Path, work: Path):
    refinement_chart.draw(pd.read_csv(folder / "refinement.csv", comment="#"), work / "refinement")
    yield folder / "refinement.png"


STUDIES = {
    "frontier/points.csv": of_frontier,
    "atlas/boundaries.csv": of_atlas,
    "convergence.csv": of_convergence,
    "experiment.csv": of_experiment,
    "refinement.csv": of_refinement,
}


def draw(study, folder: Path) -> list[Path]:
    """Puts the pictures of one of the STUDIES beside its table; returns them."""
    with temporary() as work:
        pictures = list(study(folder, work))
        for picture in pictures:
            shutil.copyfile(work / picture.name, picture)
    return pictures


def main() -> int:
    for name, study in STUDIES.items():
        for table in sorted((ROOT / "cases").glob(f"*/reference/{name}")):
            for picture in draw(study, table.parents[len(Path(name).parts) - 1]):
                print(picture.relative_to(ROOT))
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(main))
