"""What a run of the continuum says of its own numerics, as plain numbers.

    python3 -m compare.study.figures CASE TASK -o RESULT.json
"""

import sys
from pathlib import Path

import numpy as np

from cases.scratch import temporary
from cases.stages import Stage, run_stages

from compare.metrics.centre_of_mass_x import centre_of_mass_x
from compare.metrics.final_height import final_height
from compare.metrics.kinetic_energy_peak import kinetic_energy_peak
from compare.metrics.kinetic_energy_peak_time import kinetic_energy_peak_time
from compare.metrics.pressure_roughness import CUBIC
from compare.mapping.reductions import mass_quantile
from compare.mapping.runs import Run, map_fields, open_fields, open_run, seconds_of
from compare.study import job
from compare.study.recipe import Recipe

JITTER = 1e-10  # point spacings that a perturbed run's points are displaced by
ACCOUNTS = (
    "dissipated_plastic",
    "dissipated_regime_4",
    "dissipated_contact",
    "loss_transfer",
    "loss_time_integration",
    "loss_mixing",
    "loss_detached",
)
WHOLE_CELLS = 2  # between the surface and the points whose pressure counts


def figures(run: Run) -> dict:
    """Of a run with its fields: run-outs [L0] by 99.5, 99 and 95 % of the mass, centre of mass
    along x [L0], height of the free surface [L0], peak [of the energy released] and its time
    [sqrt(H/g)]; accounts at the end and `loss`, of transfer and time integration, over the energy
    released; roughness of the pressure.
    """
    run.reference_energy = run.released()
    end = run.clouds[-1]
    front, near_front, most = (
        mass_quantile(end.x[:, 0], end.mass, share) for share in (0.995, 0.99, 0.95)
    )
    accounts = {name: run.normalised(name)[-1] for name in ACCOUNTS if name in run.energy}
    cells, nodes = pressure_roughness(run)
    return (
        {
            "run_out": front / run.length - 1.0,
            "run_out_99": near_front / run.length - 1.0,
            "run_out_95": most / run.length - 1.0,
            "centre": centre_of_mass_x(run),
            "height": final_height(run),
            "peak_time": kinetic_energy_peak_time(run),
            "peak": kinetic_energy_peak(run),
            "loss": accounts["loss_transfer"] + accounts["loss_time_integration"],
        }
        | accounts
        | {
            "split": accounts["dissipated_regime_4"] / accounts["dissipated_plastic"]
            if accounts.get("dissipated_plastic")
            else float("nan"),
            "roughness_cells": cells,
            "roughness_nodes": nodes,
            "until": run.tau()[-1],
            "points": len(end.mass),
            "steps": int(run.attributes["steps"]),
            "cpu_seconds_engine": seconds_of(run, "cpu_seconds_engine"),
            "solver": run.attributes["commit"],
        }
    )


def at_end(result: Path) -> Run:
    """The run of a result, with the fields of its last frame, mapped beside it."""
    run, fields = open_run(result), result.with_name("fields.h5")
    map_fields([result], fields, "--frame", str(len(run.time) - 1), "--threads", "1")
    run.mapped = open_fields(fields, run.name)
    return run


def pressure_roughness(run: Run) -> tuple[float, float]:
    """Root mean square of the pressure about a cubic over its mean, where the column stood: of the
    cells' means, and of these averaged once more through the grid's quadratic B-splines, as its
    momentum balance does; NaN where too few points lie deep enough.
    """
    cloud, h = run.clouds[-1], run.case["mpm.cell_size"]
    x, volume = cloud.x[:, :2], cloud.solid_volume * (1.0 + cloud.state["void_ratio"])
    cell = np.floor(x / h).astype(int)
    columns = cell[:, 0].max() + 1
    top = np.zeros(columns)
    np.maximum.at(top, cell[:, 0], x[:, 1])
    deep = (x[:, 0] < run.length) & (top[cell[:, 0]] - x[:, 1] > WHOLE_CELLS * h)
    if deep.sum() <= 2 * len(CUBIC):
        return float("nan"), float("nan")
    cells = averaged(
        cloud.state["pressure"], volume, [(cell[:, 0] + columns * cell[:, 1], np.ones(len(x)))]
    )
    t = x / h - cell
    along = [[0.5 * (1 - s) ** 2, 0.5 + s * (1 - s), 0.5 * s**2] for s in t.T]
    nodes = averaged(
        cells,
        volume,
        [
            (cell[:, 0] + i + (columns + 2) * (cell[:, 1] + j), along[0][i] * along[1][j])
            for i in range(3)
            for j in range(3)
        ],
    )
    basis = np.stack(
        [(x[deep, 0] / run.length) ** i * (x[deep, 1] / run.height) ** j for i, j in CUBIC], axis=1
    )

    def rough(p):
        residual = p[deep] - basis @ np.linalg.lstsq(basis, p[deep], rcond=None)[0]
        return float(np.sqrt(np.mean(residual**2)) / p[deep].mean())

    return rough(cells), rough(nodes)


def averaged(values, volume, shares):
    """Points to places and back: shares holds, for each place a point has a share in, (its number,
    the share).
    """
    count = max(place.max() for place, _ in shares) + 1
    weight = sum(np.bincount(place, volume * share, count) for place, share in shares)
    total = sum(np.bincount(place, volume * share * values, count) for place, share in shares)
    mean = np.divide(total, weight, out=np.zeros(count), where=weight > 0.0)
    return sum(share * mean[place] for place, share in shares)


def make(scene: Path, task: dict) -> dict:
    recipe = Recipe.of(task)
    with temporary() as folder:
        result = folder / "run.h5"
        run_stages([Stage(recipe.label, recipe.words(scene, result))], quiet=True)
        return {
            name: value if isinstance(value, (int, str)) else float(value)
            for name, value in figures(at_end(result)).items()
        }


if __name__ == "__main__":
    sys.exit(job.run("compare.study.figures", __doc__, make))
