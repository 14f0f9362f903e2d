"""Simple shear at constant volume: pressure, granular temperature and stress ratio over solid fraction and shear rate."""
from pathlib import Path

import numpy as np

from compare.element.calibration import by_point, mean_and_error
from compare.element.charts import card_legend, colours, line_styles, plt, save, styled


@styled
def draw(rows: list[dict], models: dict, path: Path) -> list[Path]:
    """`rows` of the reference, `models` by card name; DEM points carry their standard error over seeds."""
    figure, ((a, b), (c, d)) = plt.subplots(2, 2, figsize=(10, 7.5), layout="constrained")
    grains = next(iter(models.values())).grains
    points = by_point(rows, ("shear_rate", "solid_fraction"), lambda seeds: seeds)
    rates = sorted({rate for rate, _ in points})
    nu_dem = np.array(sorted({nu for _, nu in points}))
    nu = np.unique(
        np.concatenate(
            [
                np.linspace(max(0.05, nu_dem[0] - 0.03), nu_dem[-1], 80),
                *(model.nu_c + np.array([-3e-4, -1e-4, 0, 1e-4]) for model in models.values()),
            ]
        )
    )
    views = (
        (a, lambda s, r: s["pressure"] / (grains.density * (r * grains.diameter) ** 2), "log"),
        (b, lambda s, r: s["granular_temperature"] / (r * grains.diameter) ** 2, "log"),
        (c, lambda s, r: s["shear_stress"] / s["pressure"], "linear"),
    )
    for rate, colour in zip(rates, colours(len(rates))):
        for axes, view, _ in views:
            at = [
                (fraction, mean_and_error([view(seed[0], rate) for seed in seeds]))
                for (r, fraction), seeds in points.items()
                if r == rate
            ]
            axes.errorbar(
                [x for x, _ in at],
                [m for _, (m, _) in at],
                [e for _, (_, e) in at],
                fmt="o",
                markersize=4,
                color=colour,
                label=f"{rate:g} /s",
            )
            for (name, model), style in zip(models.items(), line_styles(models).values()):
                axes.plot(nu, view(model.shear(nu, rate), rate), style, color=colour, linewidth=1.1)
    span = np.geomspace(rates[0] / 2, rates[-1] * 2, 12)
    for fraction, colour in zip(nu_dem, colours(len(nu_dem), "plasma")):
        at = [
            (r, mean_and_error([seed[0]["pressure"] for seed in seeds]))
            for (r, f), seeds in points.items()
            if f == fraction
        ]
        d.errorbar(
            [r for r, _ in at],
            [m for _, (m, _) in at],
            [e for _, (_, e) in at],
            fmt="o",
            markersize=4,
            color=colour,
            label=f"ν = {fraction:g}",
        )
        for model, style in zip(models.values(), line_styles(models).values()):
            d.plot(
                span,
                model.shear(np.full_like(span, fraction), span)["pressure"],
                style,
                color=colour,
                linewidth=1.1,
            )
    for axes, _, scale in views:
        axes.set(xlabel="solid fraction ν", yscale=scale)
    a.set_ylabel("p / ρ(γ̇d)²")
    b.set_ylabel("T / (γ̇d)²")
    c.set_ylabel("s / p")
    d.set(xlabel="shear rate γ̇ [1/s]", ylabel="p [Pa]", xscale="log", yscale="log")
    d.legend(fontsize=7, ncols=2)
    c.legend(fontsize=8, title="shear rate")
    card_legend(a, models)
    figure.suptitle("Simple shear at constant volume, steady state")
    return save(figure, path)
