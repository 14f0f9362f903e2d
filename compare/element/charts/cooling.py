"""Homogeneous cooling: granular temperature over time, without and with friction, and the late cooling rate."""
from pathlib import Path

import numpy as np

from compare.element.calibration import by_point, haff_slope, mean_and_error
from compare.element.charts import card_legend, colours, line_styles, plt, save, styled
from dem_reference.element.cooling import haff_rate


@styled
def draw(rows: list[dict], models: dict, path: Path) -> list[Path]:
    """`rows` of the reference, `models` by card name; without friction the cards are all one, plain kinetic theory."""
    grains = next(iter(models.values())).grains
    points = by_point(rows, ("friction", "solid_fraction"), lambda seeds: seeds)
    frictions = sorted({mu for mu, _ in points})
    fractions = sorted({nu for _, nu in points})
    figure, panels = plt.subplots(
        1, len(frictions) + 1, figsize=(5 * (len(frictions) + 1), 4.2), layout="constrained"
    )
    fine = np.linspace(fractions[0], fractions[-1], 50)
    for mu, axes, marker in zip(frictions, panels, "os^v"):
        laws = models if mu else {"kinetic theory": next(iter(models.values())).frictionless()}
        slopes = []
        for nu, colour in zip(fractions, colours(len(fractions))):
            seeds = points.get((mu, nu))
            if not seeds:
                continue
            T0 = seeds[0][0]["granular_temperature"]
            unit = 1 / haff_rate(nu, grains.restitution, T0, grains.diameter)
            time = np.array([row["time"] for row in seeds[0]])
            curves = np.array([[row["temperature"] for row in seed] for seed in seeds])
            axes.fill_between(
                time / unit,
                curves.min(0) / T0,
                curves.max(0) / T0,
                color=colour,
                alpha=0.3,
                linewidth=0,
            )
            axes.plot(
                time[::4] / unit,
                curves.mean(0)[::4] / T0,
                "o",
                markersize=3,
                color=colour,
                label=f"ν = {nu:g}",
            )
            temperature = np.geomspace(T0, curves.min(), 100)
            for model, style in zip(laws.values(), line_styles(laws).values()):
                axes.plot(
                    model.cooling_time(nu, T0, temperature) / unit,
                    temperature / T0,
                    style,
                    color=colour,
                    linewidth=1.1,
                )
            slopes.append(
                (
                    nu,
                    *mean_and_error(
                        [np.exp(haff_slope(seed)) * np.sqrt(T0) * unit for seed in seeds]
                    ),
                )
            )
        axes.set(
            xlabel="t / τ, Haff time of hard frictionless spheres",
            ylabel="T / T₀",
            yscale="log",
            title=f"μ = {mu:g}",
        )
        axes.legend(fontsize=8, title="solid fraction")
        panels[-1].errorbar(
            *np.array(slopes).T[:2],
            np.array(slopes).T[2],
            fmt=marker,
            markersize=4,
            color="k",
            label=f"DEM, μ = {mu:g}",
            markerfacecolor="w" if mu == 0 else "k",
        )
        for (name, model), style in zip(laws.items(), line_styles(laws).values()):
            first, last = np.array([[0.2], [0.05]]) * T0
            rate = (last**-0.5 - first**-0.5) / (
                model.cooling_time(fine, T0, last) - model.cooling_time(fine, T0, first)
            )
            panels[-1].plot(
                fine,
                rate * np.sqrt(T0) / haff_rate(fine, grains.restitution, T0, grains.diameter),
                style,
                color="C0" if mu else "C1",
                label=f"{name}, μ = {mu:g}",
            )
    panels[-1].set(
        xlabel="solid fraction ν",
        ylabel="late cooling rate d(T^-1/2)/dt, relative to Haff's",
        ylim=(0, None),
    )
    panels[-1].legend(fontsize=8)
    card_legend(panels[len(frictions) - 1], models)
    figure.suptitle("Homogeneous cooling")
    return save(figure, path)
