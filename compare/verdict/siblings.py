"""Numerical error bars: what the continuum's figures may be off by, told from two cheap runs.

    coarse  the same on cells 1.6 times as wide
    slow    that with its three relaxation times three times as long

The bar is twice the distance to the farther of the two. Errors that fall with the cells' power p
are 1/(1.6^p - 1) of the distance to the coarse run: 5/3 at first order, two at p = 0.86, since not
every figure is at first order yet on the cells that are used. The slow run is as coarse, and tells
what the relaxation times do; and two siblings seldom both come near the run by chance. It is a
bound to go by, no confidence interval, and counts neither what the grains scatter by nor what the
law has wrong.
"""

from dataclasses import dataclass
from math import ceil
from pathlib import Path

from cases.case import Case
from cases.files import write_atomically
from cases.programs import program
from cases.scratch import temporary
from cases.stages import Stage, run_chains
from compare.mapping.runs import Run, open_fields, open_run
from compare.metrics import Metric, all_metrics

COARSER, SLOWER = 1.6, 3.0
FACTOR = 2.0  # error of the run over its distance from the farther sibling
TIMES = ("velocity_relaxation", "gradient_relaxation", "void_ratio_relaxation")
WORDS = {
    "coarse": "continuum, coarser cells",
    "slow": "continuum, slower filters",
}


@dataclass(frozen=True)
class Siblings:
    coarse: Run
    slow: Run


def overrides(case: Case) -> dict[str, list[str]]:
    """The assignments that make each sibling of a case."""
    size = COARSER * case["mpm.cell_size"]
    if case["geometry.dimension"] == "three_dimensional":  # front and back are faces of the grid
        thickness = case["geometry.thickness"]
        size = thickness / max(1, round(thickness / size))
    coarse = [f"mpm.cell_size={float(size)!r}"]
    if case["initial.state"] == "packing":  # every cell of the packing needs a point
        coarse.append(f"mpm.points_per_cell={min(10, ceil(COARSER * case['mpm.points_per_cell']))}")
    slow = [f"mpm.{name}={min(1e9, SLOWER * case[f'mpm.{name}'])!r}" for name in TIMES]
    return {"coarse": coarse, "slow": coarse + slow}


def files(folder: Path) -> list[Path]:
    """Runs of siblings that a run's folder holds: both or none."""
    found = [folder / "siblings" / f"{name}.h5" for name in WORDS]
    return found if all(path.exists() for path in found) else []


def stages(case: Case, words: list, folder: Path) -> list[Stage]:
    """The stages that make a folder's siblings. `words`: what mpm_run is told for the run itself,
    all but the result.
    """
    target = folder / "siblings"
    target.mkdir(exist_ok=True)
    return [
        Stage(
            WORDS[name],
            [
                program("mpm_run"),
                *words,
                *(word for assignment in sets for word in ("--set", assignment)),
                "--progress",
                "-o",
                target / f"{name}.h5",
            ],
            dispensable=True,
            result=target / f"{name}.h5",
        )
        for name, sets in overrides(case).items()
    ]


def make(folder: Path, mpm: Run, dem: Path, quiet: bool = False):
    """Runs the siblings of `mpm` that a folder lacks; `dem` holds the packing, if it began from
    one.
    """
    if files(folder):
        return
    with temporary() as scratch:
        scene = scratch / "mpm.toml"
        scene.write_text(mpm.case.resolved)
        words = [scene, "--seed", mpm.attributes["seed"]]
        words += ["--packing", dem] if mpm.case["initial.state"] == "packing" else []
        note(folder, run_chains([stages(mpm.case, words, folder)], quiet=quiet))


def note(folder: Path, failed: dict[str, str]):
    """Keeps in the folder what siblings said that failed, by their stages' names."""
    if failed:
        lines = [f"{name}: {line}\n" for name, line in failed.items()]
        write_atomically(folder / "siblings" / "failed.txt", "".join(lines))


def failure(folder: Path) -> str:
    """Why a folder has no siblings, where they were tried; else ""."""
    said = folder / "siblings" / "failed.txt"
    return "; ".join(said.read_text().splitlines()) if said.exists() else ""


def load(folder: Path) -> Siblings | None:
    """The siblings of a folder whose fields.h5 holds theirs; None where there are none."""
    runs = [open_run(path) for path in files(folder)]
    for run in runs:
        run.mapped = open_fields(folder / "fields.h5", run.name)
    return Siblings(*runs) if runs else None


def bar(to_coarse: float, to_slow: float) -> float:
    """The numerical error of a figure, from how far the run is from its siblings in it."""
    return FACTOR * max(abs(to_coarse), abs(to_slow))


def uncertainty(mpm: Run, dem: Run, siblings: Siblings) -> dict[str, float]:
    """The bar of each metric that is a figure of the continuum's solution, in the metric's unit.
    Brings the siblings to the mass and energy scale of the run.
    """
    for run in (siblings.coarse, siblings.slow):
        run.mass_scale = mpm.mass_scale * mpm.mass / run.mass
        run.reference_energy = mpm.reference_energy

    def of(metric: Metric) -> float:
        runs = (mpm, siblings.coarse, siblings.slow)
        main, coarse, slow = (metric(run, dem) if metric.of_pair else metric(run) for run in runs)
        return bar(main - coarse, main - slow)

    return {
        name: of(metric)
        for name, metric in all_metrics().items()
        if metric.unit != "s"  # processor time is no figure of the solution
    }
