"""Effective friction over the inertial number: the grains', and each law's in the same cells."""

from pathlib import Path

import matplotlib.pyplot as plt

from compare.judge.charts import NAME, answered, band, binned, curve, each, over_inertial_number
from compare.judge.charts import styles
from compare.judge.trial import Trial
from compare.study.charts import STUDY_STYLE, save
from compare.study.page import Figure

WORDS = [
    "Effective friction μ_D = s:D/(p γ̇), what the stress does to the flow, in all cells that "
    "flow; means weighted by p γ̇, so that a curve twice as high does twice the work.",
    "The band is the range over packings and kernel widths. A law's curve is its answer in steady "
    "shear at the same cells' p and γ̇.",
]


def draw(trial: Trial, path: Path) -> Figure:
    look = styles(trial)
    with plt.rc_context(STUDY_STYLE):
        figure, ax = plt.subplots(figsize=(9.0, 5.4), layout="constrained")
        cells = each(trial)
        band(ax, [binned(one, one.friction, one.unit_work) for one in cells], NAME[trial.engine])
        for law in trial.laws:
            answers = [binned(one, answered(law, one, "friction"), one.unit_work) for one in cells]
            curve(ax, answers, look[law.label])
        over_inertial_number(ax, "μ_D")
        ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=7.5)
        return "Friction", list(WORDS), save(figure, path, {})
