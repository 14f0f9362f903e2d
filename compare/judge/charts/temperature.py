"""Granular temperature and its dissipation over the inertial number, of the laws that know one."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from compare.judge.charts import NAME, answered, band, binned, curve, each
from compare.judge.charts import over_inertial_number, styles
from compare.judge.trial import Trial
from compare.study.charts import STUDY_STYLE, save
from compare.study.page import Figure

WORDS = [
    "Left: T/(γ̇d)², geometric means weighted by work; a law's is its own in steady shear at the "
    "cells' p and γ̇.",
    "Right: what is dissipated. The grains' is the power at their contacts, a law's that of "
    "plastic flow and collisions with T held at the cells' own; both over the work s:D done there. "
    "At one a flow dissipates what is done on it.",
]


def draw(trial: Trial, path: Path) -> Figure:
    look, d = styles(trial), trial.scene["grains.diameter"]
    warm = [law for law in trial.laws if law.held is not None]
    with plt.rc_context(STUDY_STYLE):
        figure, (left, right) = plt.subplots(1, 2, figsize=(12.0, 4.2), layout="constrained")
        cells = each(trial)

        def scaled(one, temperature):
            with np.errstate(divide="ignore", invalid="ignore"):
                return np.exp(
                    binned(one, np.log(temperature / (one.shear_rate * d) ** 2), one.work)
                )

        band(left, [scaled(one, one.temperature) for one in cells], NAME[trial.engine])
        for law in warm:
            own = [scaled(one, answered(law, one, "temperature")) for one in cells]
            curve(left, own, look[law.label])

        def spent(one, power):
            volume = np.where(np.isfinite(power), one.weight, np.nan)
            return binned(one, power, volume) / binned(one, one.work / one.weight, volume)

        if any(np.isfinite(one.dissipation).any() for one in cells):
            band(right, [spent(one, one.dissipation) for one in cells], NAME[trial.engine])
        for law in warm:
            curve(
                right,
                [spent(one, answered(law, one, "dissipation", held=True)) for one in cells],
                look[law.label],
            )
        for ax, label in ((left, "T / (γ̇d)²"), (right, "Γ / (s:D)")):
            over_inertial_number(ax, label)
        left.set_yscale("log")
        left.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        left.yaxis.set_minor_formatter(lambda value, _: f"{value:g}")
        right.axhline(1.0, color="#8a8f98", lw=0.8)
        right.legend(
            *left.get_legend_handles_labels(),
            loc="upper left",
            bbox_to_anchor=(1.01, 1.0),
            fontsize=7.5,
        )
        return "Granular temperature and its dissipation", list(WORDS), save(figure, path, {})
