"""A steady flow over its depth: the grains' friction, granular temperature and solid fraction, and
each law's at the same heights.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from compare.judge.charts import NAME, answered, each, styles
from compare.judge.trial import Trial
from compare.study.charts import STUDY_STYLE, save
from compare.study.page import Figure

WORDS = [
    "At every height of the steady flow, averaged over the second half of the runs: black what is "
    "there, its band the range over packings and kernel widths; coloured what a law answers to the "
    "p and γ̇ of that height, of the first packing and the narrowest kernel.",
    "A law that answers with less friction would flow faster than that, one with more slower; "
    "where its solid fraction is another its layer is deeper or flatter.",
]


def draw(trial: Trial, path: Path) -> Figure:
    look, d = styles(trial), trial.scene["grains.diameter"]
    first = trial.runs[0][0]
    panels = {  # of cells, and of a law's answers to them
        "μ_D": (lambda one: one.friction, lambda law: answered(law, first, "friction")),
        "T / (γ̇d)²": (
            lambda one: one.temperature / (one.shear_rate * d) ** 2,
            lambda law: answered(law, first, "temperature") / (first.shear_rate * d) ** 2,
        ),
        "solid fraction": (
            lambda one: one.solid_fraction,
            lambda law: 1.0 / (1.0 + answered(law, first, "void_ratio")),
        ),
    }
    knows = (lambda law: True, lambda law: law.fluctuates, lambda law: law.dilates)
    with plt.rc_context(STUDY_STYLE):
        figure, axes = plt.subplots(1, 3, figsize=(12.0, 4.6), sharey=True, layout="constrained")
        for ax, (label, (there, told)), known in zip(axes, panels.items(), knows):
            band(ax, [(one.y / d, there(one)) for one in each(trial)], NAME[trial.engine])
            for law in filter(known, trial.laws):
                ax.plot(told(law), first.y / d, lw=1.4, **look[law.label])
            ax.set(xlabel=label)
        axes[0].set(ylabel="y / d")
        axes[-1].legend(
            *axes[0].get_legend_handles_labels(),
            loc="upper left",
            bbox_to_anchor=(1.01, 1.0),
            fontsize=7.5,
        )
        return "Over the depth", list(WORDS), save(figure, path, {})


def band(ax, curves: list[tuple[np.ndarray, np.ndarray]], label: str):
    """Mean and range of (heights, values) of packings and widths, over heights that all have."""
    low, high = max(y.min() for y, _ in curves), min(y.max() for y, _ in curves)
    y = np.linspace(low, high, 40)
    stack = np.array([np.interp(y, *curve) for curve in curves])
    ax.fill_betweenx(y, stack.min(axis=0), stack.max(axis=0), color="#26292e", alpha=0.15, lw=0)
    ax.plot(stack.mean(axis=0), y, "o-", color="#26292e", ms=3.0, label=label, zorder=5)
