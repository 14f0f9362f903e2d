"""Drained triaxial compression: stress ratio and void ratio over axial strain."""
from pathlib import Path

import numpy as np

from compare.element.calibration import by_point
from compare.element.charts import card_legend, colours, line_styles, plt, save, styled


@styled
def draw(rows: list[dict], models: dict, path: Path) -> list[Path]:
    """`rows` of the reference, `models` by card name; bands span the DEM seeds. The law starts from the mean void ratio."""
    points = by_point(rows, ("pressure", "preparation_friction"), lambda seeds: seeds)
    figure, (a, b) = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
    for ((pressure, mu), seeds), colour in zip(points.items(), colours(len(points))):
        strain = np.array([row["axial_strain"] for row in seeds[0]])
        axial, lateral, void_ratio = (
            np.array([[row[name] for row in seed] for seed in seeds])
            for name in ("axial_stress", "lateral_stress", "void_ratio")
        )
        ratio = 3 * (axial - lateral) / (axial + 2 * lateral)
        for axes, values in ((a, ratio), (b, void_ratio)):
            axes.fill_between(
                strain, values.min(0), values.max(0), color=colour, alpha=0.25, linewidth=0
            )
            axes.plot(
                strain,
                values.mean(0),
                "o",
                markersize=2.5,
                color=colour,
                label=f"{pressure / 1e3:g} kPa, prepared with μ = {mu:g}",
            )
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
