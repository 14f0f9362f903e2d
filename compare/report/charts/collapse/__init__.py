"""Figures 3 to 8 of [Ceccato2019], one file each, of one run of the continuum, and what follows
them until rest.

Here what the maps share: a quantity of the points at the same instants.
"""

import matplotlib.pyplot as plt
import numpy as np

from compare.report.charts import NARROW, WIDE
from compare.mapping.reductions import mass_quantile

INSTANTS = (
    0.5,
    1.0,
    1.5,
    2.0,
    3.0,
)  # sqrt(H/g), before and after the peak of kinetic energy; the paper's text names no times


def instants(run) -> list[int]:
    """Frames nearest to INSTANTS, as far as the run goes, and its last."""
    tau, last = run.tau(), len(run.time) - 1
    return sorted({int(np.argmin(abs(tau - t))) for t in INSTANTS if t < tau[-1]} | {last})


def when(run, frame: int) -> str:
    if frame < len(run.time) - 1:
        return f"t = {run.tau()[frame]:.1f} √(H/g)"
    end = "at rest" if run.attributes.get("end_reason") == "rest" else "end"
    return f"{end}, t = {run.tau()[frame]:.1f} √(H/g)"


def reach(run) -> tuple[float, float]:
    """How far maps go in x and y [L0]: to the last of the deposit but for single points, and over
    the column.
    """
    end = run.clouds[-1]
    return (
        max(1.1, 1.03 * mass_quantile(end.x[:, 0], end.mass, 0.998) / run.length),
        1.06 * run.height / run.length,
    )


def scatter(ax, run, frame: int, values, inches: float, **options):
    """Points as squares that fill the column at release, on axes that are `inches` wide."""
    cloud = run.clouds[frame]
    spacing = np.sqrt(run.length * run.height / len(cloud.mass)) / run.length
    side = 1.05 * 72.0 * inches * spacing / reach(run)[0]  # in points of print
    artist = ax.scatter(
        *(cloud.x[:, :2].T / run.length),
        c=values,
        s=side**2,
        marker="s",
        linewidths=0.0,
        rasterized=True,
        **options,
    )
    ax.set(aspect="equal", xlim=(0.0, reach(run)[0]), ylim=(0.0, reach(run)[1]))
    ax.grid(False)
    return artist


def draw_points(run, narrow, values, cmap, norm, frames=None):
    """A panel per instant with the points coloured by values(frame) -> (N,); returns the figure,
    its axes and an artist to make a colour bar of.
    """
    frames = instants(run) if frames is None else frames
    far, top = reach(run)
    width, columns = (NARROW, 1) if narrow else (WIDE, 2)
    rows = -(-len(frames) // columns)
    inches = (width - 0.55 * columns) / columns
    figure, axes = plt.subplots(
        rows,
        columns,
        figsize=(width, (inches * top / far + 0.36) * rows + 0.85),
        squeeze=False,
        sharex=True,
        sharey=True,
        layout="constrained",
    )
    for ax, frame in zip(axes.ravel(), frames):
        artist = scatter(ax, run, frame, values(frame), inches, cmap=cmap, norm=norm)
        ax.set_title(when(run, frame), loc="left")
    for ax in axes.ravel()[len(frames) :]:
        ax.set_visible(False)
    for ax in axes[:, 0]:
        ax.set_ylabel("$y/L_0$")
    for ax in axes[-1]:
        ax.set_xlabel("$x/L_0$")
    return figure, axes, artist


def colour_bar(figure, axes, artist, label: str, **options):
    return figure.colorbar(
        artist, ax=axes, location="bottom", label=label, shrink=0.7, aspect=45, pad=0.02, **options
    )
