"""Where and when a law is too stiff or too weak: maps of its friction over the grains'."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LogNorm
from scipy import ndimage

from compare.judge.charts import NAME, answered
from compare.judge.trial import Trial
from compare.study.charts import STUDY_STYLE, save
from compare.study.page import Figure

TIMES = (0.4, 0.8, 1.2, 2.0)  # sqrt(H/g)
SMOOTH = 2.0  # cells over which works are summed before they are divided
WORDS = [
    "The law's work over the work done, both summed over a few cells, in the first packing and the "
    "widest kernel: red is too stiff, blue too weak, white is right. Only what flows is shown.",
]


def draw(trial: Trial, path: Path) -> Figure:
    cells = trial.runs[0][-1]
    times = np.unique(cells.tau)
    shown = [times[np.argmin(abs(times - t))] for t in TIMES]
    with plt.rc_context(STUDY_STYLE):
        rows = len(trial.laws)
        figure, axes = plt.subplots(
            rows,
            len(shown),
            figsize=(11.0, 0.7 + 1.15 * rows),
            sharex=True,
            sharey=True,
            layout="constrained",
            squeeze=False,
        )
        length = trial.scene["geometry.length"]
        mesh = None
        for law, line in zip(trial.laws, axes):
            answer = answered(law, cells, "friction")
            for t, ax in zip(shown, line):
                x, y, ratio = ratios(cells, answer, t)
                mesh = ax.pcolormesh(
                    x / length,
                    y / length,
                    ratio,
                    norm=LogNorm(0.5, 2.0),
                    cmap="RdBu_r",
                    rasterized=True,
                )
                ax.set_aspect("equal")
                ax.grid(False)
            line[0].set_ylabel("y / L0")
            line[0].text(0.0, 1.04, law.label, transform=line[0].transAxes, fontsize=8)
        for t, ax in zip(shown, axes[0]):
            ax.set_title(f"{t:.2f} √(H/g)", loc="right", fontsize=8.5, pad=16)
        for ax in axes[-1]:
            ax.set_xlabel("x / L0")
        bar = figure.colorbar(mesh, ax=axes, shrink=0.6, ticks=[0.5, 0.7, 1.0, 1.4, 2.0])
        bar.ax.set_yticklabels(["0.5", "0.7", "1", "1.4", "2"])
        bar.ax.minorticks_off()
        bar.set_label(f"μ_D of the law / {NAME[trial.engine]}")
        return "Where and when", list(WORDS), save(figure, path, {})


def ratios(cells, answer, t):
    """x, y (edges) [m], the ratio of works (ny, nx) at t [sqrt(H/g)]; NaN where nothing flows."""
    now = (cells.tau == t) & (cells.zone > 0) & np.isfinite(answer)
    one = cells.where(now)
    h = spacing(cells)
    i, k = np.round(one.x / h - 0.5).astype(int), np.round(one.y / h - 0.5).astype(int)
    shape = (int(cells.y.max() / h) + 2, int(cells.x.max() / h) + 2)
    base = one.pressure * one.shear_rate
    done, would = np.zeros(shape), np.zeros(shape)
    np.add.at(done, (k, i), base * one.friction)
    np.add.at(would, (k, i), base * answer[now])
    there = done != 0.0
    done, would = (ndimage.gaussian_filter(a, SMOOTH) for a in (done, would))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(there & (done > 0.0), would / done, np.nan)
    return np.arange(shape[1] + 1) * h, np.arange(shape[0] + 1) * h, ratio


def spacing(cells) -> float:
    """Of the cells [m]."""
    return float(np.min(np.diff(np.unique(cells.x))))
