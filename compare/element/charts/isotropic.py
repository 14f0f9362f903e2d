"""Isotropic compression and unloading: elastic moduli and void ratio over pressure."""
from pathlib import Path

import numpy as np

from compare.element.calibration import by_point, mean_and_error
from compare.element.charts import card_legend, colours, line_styles, plt, save, styled


@styled
def draw(rows: list[dict], models: dict, path: Path) -> list[Path]:
    """`rows` of the reference, `models` by card name; the elastic path of e(p) starts at the first DEM state."""
    points = by_point(rows, ("preparation_friction",), lambda seeds: seeds)
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
            panels[2].plot(
                fine,
                model.isotropic(series["void_ratio"][0][0], pressure[0], fine),
                style,
                color=colour,
                linewidth=1.1,
            )
    for model, style in zip(models.values(), line_styles(models).values()):
        for axes, modulus in zip(panels, model.moduli(fine)):
            axes.plot(fine, modulus, style, color="0.3", linewidth=1.1)
    for axes, label, scale in zip(
        panels,
        ("bulk modulus K [Pa]", "shear modulus G [Pa]", "void ratio e"),
        ("log", "log", "linear"),
    ):
        axes.set(xlabel="pressure p [Pa]", ylabel=label, xscale="log", yscale=scale)
    panels[0].legend(fontsize=7)
    card_legend(panels[2], models)
    figure.suptitle("Isotropic compression and unloading")
    return save(figure, path)
