"""A picture of both sides at three instants: for paper, and where no WebGL is."""

import base64
import io

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import EllipseCollection
from matplotlib.colors import ListedColormap

from cases.style import INK, STYLE
from compare.report.player.quantities import Quantity
from compare.report.player.tracks import SIDES, Track

INSTANTS = 3


def instants(tracks: list[Track], peak: float) -> list[float]:
    """Times [s]: of the peak, of 1.8 times that, and the end."""
    end = min(float(track.time[-1]) for track in tracks)
    return [min(peak, end), min(1.8 * peak, end), end]


def picture(
    tracks: list[Track],
    quantity: Quantity,
    times: list[float],
    view: tuple[float, float, float, float],
    scale: float,
) -> str:
    """A data URI of a PNG: rows of instants, a column a side, coloured by what is known of
    `quantity`; `view` is x from, x to, y from, y to [m], `scale` the unit of time [s].
    """
    x0, x1, y0, y1 = view
    panel = 4.9 * (y1 - y0) / (x1 - x0) + 0.25
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(
            len(times), len(tracks), figsize=(10.0, panel * len(times) + 0.7), squeeze=False,
            sharex=True, sharey=True, layout="constrained",
        )  # fmt: skip
        for row, t in zip(axes, times):
            for ax, track in zip(row, tracks):
                frame = int(np.argmin(abs(track.time - t)))
                dots = particles(ax, track, quantity, frame)
                heights = np.where(track.surface[frame] > 0.0, track.surface[frame], np.nan)
                ax.plot(track.columns, heights, color=INK, linewidth=1.0)
                ax.set(xlim=(x0, x1), ylim=(y0, y1), aspect="equal", xticks=[], yticks=[])
                ax.grid(False)
                title = f"{SIDES[track.engine][0]}, t = {track.time[frame] / scale:.1f} √(H/g)"
                ax.set_title(title, loc="left")
        figure.colorbar(
            dots,
            ax=axes,
            location="bottom",
            label=f"{quantity.label} [{quantity.unit}]",
            shrink=0.5,
            aspect=45,
        )
        png = io.BytesIO()
        figure.savefig(png, format="png", dpi=120)
        plt.close(figure)
    return "data:image/png;base64," + base64.b64encode(png.getvalue()).decode()


def particles(ax, track: Track, quantity: Quantity, frame: int) -> EllipseCollection:
    """Discs of the particles' own size; grey where nothing is known."""
    there = np.isfinite(track.x[frame, :, 0])
    order = np.flatnonzero(there)[np.argsort(track.x[frame, there, 2], kind="stable")]
    width = 2.0 * track.size[order]
    dots = EllipseCollection(
        width, width, np.zeros(len(order)), units="xy", offsets=track.x[frame, order, :2],
        offset_transform=ax.transData, linewidths=0, rasterized=True,
        cmap=ListedColormap(quantity.colours[1:] / 255.0),
    )  # fmt: skip
    values = track.values.get(quantity.name)
    dots.set_array(values[frame, order] if values is not None else np.full(len(order), np.nan))
    dots.set_clim(quantity.low, quantity.high)
    ax.add_collection(dots)
    return dots
