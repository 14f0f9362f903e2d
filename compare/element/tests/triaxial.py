"""Drained triaxial compression at constant lateral stress, in LIGGGHTS.

An orthogonal periodic box under servo control.
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
from dem_reference.periodic.packing import isotropic_packing
from dem_reference.periodic.servo import Servo
from dem_reference.process import Report, run_engine

STEADY = 0.75  # fraction of the axial strain after which a test is taken as critical
CURVE = 8  # points of a curve that are compared


def points(case: Case) -> list[tuple[dict, int]]:
    """Seed by seed."""
    common = {
        name: case[f"triaxial.{name}"] for name in ("axial_strain", "inertial_number", "samples")
    }
    return [
        ({"pressure": pressure, "preparation_friction": friction} | common, seed)
        for seed in case["element.seeds"]
        for friction in case["triaxial.preparation_frictions"]
        for pressure in case["triaxial.pressures"]
    ]


def run(grains: Grains, point: dict, folder: Path) -> Rows:
    """Compresses one box along y; one row per sample, averaged over the corrections since the last.

    axial_strain, volumetric_strain [-] (logarithmic, compression positive), void_ratio [-],
    axial_stress and the lateral_stress (mean of two) [Pa], lateral_error (worst relative deviation
    of a mean lateral stress), coordination [-].
    """
    log = folder / "log.liggghts"
    return run_engine(compress, grains, point, log, log=log).result


def compress(grains: Grains, point: dict, log: Path, report: Report) -> Rows:
    pressure = point["pressure"]
    box = isotropic_packing(grains, point, pressure, log)
    rate = grains.strain_rate(point["inertial_number"], pressure)
    servo = Servo(box, pressure, rate_limit=10 * rate)
    corrections = max(
        1, round(point["axial_strain"] / point["samples"] / (rate * servo.INTERVAL * box.time_step))
    )
    start = box.sides

    def row(stresses: list) -> dict:
        strain = np.log(start / box.sides)
        x, y, z = np.mean(stresses, axis=0)
        return {
            "axial_strain": strain[1],
            "volumetric_strain": strain.sum(),
            "void_ratio": box.void_ratio,
            "axial_stress": y,
            "lateral_stress": (x + z) / 2,
            "lateral_error": max(abs(x / pressure - 1), abs(z / pressure - 1)),
            "coordination": box.scalar("z"),
        }

    rows = [row([box.stress])]
    targets, rates = np.array([pressure, np.nan, pressure]), np.array([0.0, rate, 0.0])
    # A sudden start would send a stress wave.
    for start_up in np.linspace(0, 1, corrections, endpoint=False):
        servo.advance(targets, start_up * rates)
    rows.append(row([box.stress]))
    for _ in range(point["samples"]):
        rows.append(row([servo.advance(targets, rates) for _ in range(corrections)]))
    return [{name: float(value) for name, value in row.items()} for row in rows]


def series(seeds: list[Rows]) -> tuple[np.ndarray, ...]:
    """Of one point: strain, (samples,), and stress ratio q/p and void ratio, (seeds, samples)."""
    strain = np.array([row["axial_strain"] for row in seeds[0]])
    axial, lateral, void_ratio = (
        np.array([[row[name] for row in seed] for seed in seeds])
        for name in ("axial_stress", "lateral_stress", "void_ratio")
    )
    return strain, (axial - lateral) / (axial + 2 * lateral) * 3, void_ratio


def blocks(rows: Rows, choose: Choose) -> list[Block]:
    """The stress ratio at the critical state, and the void ratio along the strain."""
    points = by_point(rows, ("pressure", "preparation_friction"), choose)
    labels = [f"{p / 1e3:g} kPa, prepared with mu {mu:g}" for p, mu in points]
    ratios, curves, starts, strains, ends = [], [], [], [], []
    for seeds in points.values():
        strain, ratio, void_ratio = series(seeds)
        steady = strain > STEADY * strain[-1]
        ratios.append(mean_and_error(np.log(ratio[:, steady].mean(axis=1)), 0.01))
        picked = np.linspace(0, len(strain) - 1, CURVE + 1).round().astype(int)[1:]
        curves.append(mean_and_error(void_ratio[:, picked], 0.001))
        starts.append(void_ratio[:, 0].mean())
        strains.append(strain[picked])
        ends.append(strain[steady])
    pressures = np.array([p for p, _ in points])
    steady_ratio, steady_error = np.array(ratios).T

    def curve(law: Law) -> np.ndarray:
        answers = [law.triaxial(e, p, strain) for e, p, strain in zip(starts, pressures, strains)]
        return np.concatenate([answer["void_ratio"] for answer in answers])

    def ratio_at_end(law: Law) -> np.ndarray:
        answers = [law.triaxial(e, p, strain) for e, p, strain in zip(starts, pressures, ends)]
        return np.log([np.mean(answer["deviator"] / answer["pressure"]) for answer in answers])

    return [
        Block(
            "triaxial stress ratio", labels, steady_ratio, steady_error, MODEL_ERROR, ratio_at_end
        ),
        Block(
            "triaxial void ratio",
            [f"{label}, strain {x:.2f}" for label, xs in zip(labels, strains) for x in xs],
            np.concatenate([mean for mean, _ in curves]),
            np.concatenate([error for _, error in curves]),
            0.1 * MODEL_ERROR,
            curve,
            CURVE,
        ),
    ]


@styled
def draw(rows: Rows, models: dict[str, Law], path: Path) -> list[Path]:
    """Stress ratio and void ratio over axial strain.

    `rows` of the reference, `models` by card name; bands span the DEM seeds. The law starts from
    the mean void ratio.
    """
    points = by_point(rows, ("pressure", "preparation_friction"))
    figure, (a, b) = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
    for ((pressure, mu), seeds), colour in zip(points.items(), colours(len(points))):
        strain, ratio, void_ratio = series(seeds)
        label = f"{pressure / 1e3:g} kPa, prepared with μ = {mu:g}"
        for axes, values in ((a, ratio), (b, void_ratio)):
            axes.fill_between(
                strain, values.min(0), values.max(0), color=colour, alpha=0.25, linewidth=0
            )
            axes.plot(strain, values.mean(0), "o", markersize=2.5, color=colour, label=label)
        fine = np.linspace(0, strain[-1], 400)
        for model, style in zip(models.values(), line_styles(models).values()):
            answer = model.triaxial(void_ratio[:, 0].mean(), pressure, fine)
            a.plot(
                fine, answer["deviator"] / answer["pressure"], style, color=colour, linewidth=1.1
            )
            b.plot(fine, answer["void_ratio"], style, color=colour, linewidth=1.1)
    a.set(xlabel="axial strain", ylabel="q / p")
    b.set(xlabel="axial strain", ylabel="void ratio e")
    b.legend(fontsize=8)
    card_legend(a, models)
    figure.suptitle("Triaxial compression at constant lateral stress")
    return save(figure, path)


def driven(case: Case) -> dict:
    """The law is compressed as fast as the grains were."""
    return {"inertial_number": case["triaxial.inertial_number"]}


register(
    ComparedTest(
        "triaxial",
        order=3,
        keys=("pressure", "preparation_friction"),
        points=points,
        run=run,
        blocks=blocks,
        draw=draw,
        driven=driven,
    )
)
