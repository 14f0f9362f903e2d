"""Isotropic compression and unloading, with small probes of the elastic moduli, in LIGGGHTS.

At each pressure the packing is brought to rest and probed twice: all sides by +-probe_strain (bulk
modulus), then one side by +-probe_strain and the others by -+half of it (shear modulus).
"""

from pathlib import Path

import numpy as np

from compare.element.blocks import MODEL_ERROR, Block, Choose, by_point, mean_and_error
from compare.element.case import Case
from compare.element.charts import card_legend, colours, line_styles, plt, save, styled
from compare.element.model import Law
from compare.element.records import Rows
from compare.element.tests import ComparedTest, register
from dem_reference.grains import Grains
from dem_reference.periodic.box import Box
from dem_reference.periodic.packing import isotropic_packing
from dem_reference.periodic.servo import Servo
from dem_reference.process import Report, run_engine

REST = 2500  # steps of damping before a probe's stress is read
DAMPING = 1e-2  # viscous damping while coming to rest [kg/s]
SHEAR = np.array([-0.5, 1.0, -0.5])  # a probe at constant volume, per strain of the side y


def points(case: Case) -> list[tuple[dict, int]]:
    """Seed by seed."""
    common = {name: case[f"isotropic.{name}"] for name in ("inertial_number", "probe_strain")}
    common["pressures"] = case["isotropic.pressures"]
    return [
        ({"preparation_friction": friction} | common, seed)
        for seed in case["element.seeds"]
        for friction in case["isotropic.preparation_frictions"]
    ]


def run(grains: Grains, point: dict, folder: Path) -> Rows:
    """Takes one box through the pressures in turn; returns one row per pressure.

    pressure [Pa] as measured, unloading (0 or 1), void_ratio [-], coordination [-], bulk_modulus
    and shear_modulus [Pa].
    """
    log = folder / "log.liggghts"
    return run_engine(compress, grains, point, log, log=log).result


def compress(grains: Grains, point: dict, log: Path, report: Report) -> Rows:
    pressures, strain = point["pressures"], point["probe_strain"]
    box = isotropic_packing(grains, point, pressures[0], log)
    rows = []
    for stage, pressure in enumerate(pressures):
        limit = grains.strain_rate(point["inertial_number"], pressure)
        Servo(box, pressure, rate_limit=limit).isotropic(pressure)
        stress = at_rest(box)
        rows.append(
            {
                "pressure": float(stress.mean()),
                "unloading": int(pressure < max(pressures[: stage + 1])),
                "void_ratio": float(box.void_ratio),
                "coordination": box.scalar("z"),
                "bulk_modulus": probe(box, np.ones(3), strain).mean() / 3,
                "shear_modulus": probe(box, SHEAR, strain) @ SHEAR / 3,
            }
        )
    return rows


def at_rest(box: Box) -> np.ndarray:
    """Lets the grains come to rest in the box as it is; returns the stresses, (3,) [Pa]."""
    box.command(f"fix damp all viscous {DAMPING}")
    box.deform(np.zeros(3), REST)
    box.command("unfix damp")
    return box.stress


def probe(box: Box, direction: np.ndarray, strain: float, steps: int = 500) -> np.ndarray:
    """Stress change per strain, (3,) [Pa], when the sides shrink by +-strain x direction.

    They go back afterwards.
    """
    rates = direction * strain / (steps * box.time_step)
    box.deform(rates, steps)
    loaded = at_rest(box)
    box.deform(-2 * rates, steps)
    unloaded = at_rest(box)
    box.deform(rates, steps)
    return (loaded - unloaded) / (2 * strain)


def blocks(rows: Rows, choose: Choose) -> list[Block]:
    """Bulk and shear modulus at every pressure, looser and denser."""
    points = by_point(rows, ("preparation_friction",), choose)
    pressures = [
        np.mean([[row["pressure"] for row in seed] for seed in seeds], axis=0)
        for seeds in points.values()
    ]
    labels = [
        f"prepared with mu {mu:g}, {p / 1e3:.3g} kPa"
        for (mu,), each in zip(points, pressures)
        for p in each
    ]
    pressure = np.concatenate(pressures)

    def block(name: str, index: int) -> Block:
        pairs = [
            mean_and_error([[np.log(row[name]) for row in seed] for seed in seeds], 0.01)
            for seeds in points.values()
        ]
        return Block(
            f"isotropic {name}",
            labels,
            np.concatenate([mean for mean, _ in pairs]),
            np.concatenate([error for _, error in pairs]),
            MODEL_ERROR,
            lambda law: np.log(law.moduli(pressure)[index]),
        )

    return [block("bulk_modulus", 0), block("shear_modulus", 1)]


@styled
def draw(rows: Rows, models: dict[str, Law], path: Path) -> list[Path]:
    """Elastic moduli and void ratio over pressure.

    `rows` of the reference, `models` by card name; the elastic path of e(p) starts at the first
    DEM state.
    """
    points = by_point(rows, ("preparation_friction",))
    figure, panels = plt.subplots(1, 3, figsize=(13, 4.4), layout="constrained")
    for ((mu,), seeds), colour in zip(points.items(), colours(len(points))):
        series = {
            name: mean_and_error([[row[name] for row in seed] for seed in seeds])
            for name in ("pressure", "bulk_modulus", "shear_modulus", "void_ratio")
        }
        pressure = series["pressure"][0]
        back = np.array([row["unloading"] for row in seeds[0]]) > 0
        for axes, name in zip(panels, ("bulk_modulus", "shear_modulus", "void_ratio")):
            value, error = series[name]
            for part, face, word in ((~back, colour, "loading"), (back, "w", "unloading")):
                axes.errorbar(
                    pressure[part],
                    value[part],
                    error[part],
                    fmt="o",
                    markersize=4,
                    color=colour,
                    markerfacecolor=face,
                    label=f"{word}, prepared with μ = {mu:g}",
                )
        fine = np.geomspace(pressure.min(), pressure.max(), 25)
        for model, style in zip(models.values(), line_styles(models).values()):
            elastic = model.isotropic(series["void_ratio"][0][0], pressure[0], fine)
            panels[2].plot(fine, elastic, style, color=colour, linewidth=1.1)
    for model, style in zip(models.values(), line_styles(models).values()):
        for axes, modulus in zip(panels, model.moduli(fine)):
            axes.plot(fine, modulus, style, color="0.3", linewidth=1.1)
    labels = ("bulk modulus K [Pa]", "shear modulus G [Pa]", "void ratio e")
    for axes, label, scale in zip(panels, labels, ("log", "log", "linear")):
        axes.set(xlabel="pressure p [Pa]", ylabel=label, xscale="log", yscale=scale)
    panels[0].legend(fontsize=7)
    card_legend(panels[2], models)
    figure.suptitle("Isotropic compression and unloading")
    return save(figure, path)


register(
    ComparedTest(
        "isotropic",
        order=4,
        keys=("preparation_friction",),
        points=points,
        run=run,
        blocks=blocks,
        draw=draw,
    )
)
