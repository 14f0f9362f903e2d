import numpy as np
from matplotlib import colormaps
from matplotlib.lines import Line2D

from cases.style import INK, LABEL
from compare.report.charts import along, chart, panels
from compare.mapping.reductions import common_frames, surface

DASHED = (0, (4, 2))


def deposit(run) -> str:
    """How far and how high the deposit is."""
    x, h = run.fields.grid.x / run.length, surface(run, -1) / run.length
    far = x[h > 0.0].max(initial=0.0)
    return f"the deposit reaches to x = {far:.2f} L0 and is {h.max():.2f} L0 high"


@chart("Free surface", order=1)
def surface_profiles(comparison, narrow):
    mpm, dem = comparison.first
    frames = common_frames(mpm, dem)
    tau = mpm.tau()
    end = (len(mpm.time) - 1, len(dem.time) - 1)
    wanted = [t for t in (0.0, 0.6, 1.2, 1.8, 3.0) if t < tau[end[0]] and frames]
    shown = sorted({min(frames, key=lambda f: abs(tau[f[0]] - t)) for t in wanted} | {end})
    figure, (ax,) = panels(1, narrow, height=3.6)
    colours = colormaps["viridis"](np.linspace(0.0, 0.85, len(shown)))
    far = 0.0
    for (i, k), colour in zip(shown, colours):
        for run, frame, style in ((mpm, i, "-"), (dem, k, DASHED)):
            x, h = run.fields.grid.x / run.length, surface(run, frame) / run.length
            name = f"_{LABEL[run.engine]}, t = {run.tau()[frame]:.2f} √(H/g)"
            ax.plot(x, h, color=colour, linestyle=style, label=name)
            far = max(far, x[h > 0.0].max(initial=1.0))
    ax.set(xlabel=along(mpm), ylabel="$h/L_0$", xlim=(0.0, far + 0.1), ylim=(0.0, None))
    engines = [
        Line2D([], [], color=INK, label="MPM"),
        Line2D([], [], color=INK, linestyle=DASHED, label="DEM"),
    ]
    times = [
        Line2D([], [], color=c, label="end" if f == end else f"t = {tau[f[0]]:.1f} √(H/g)")
        for f, c in zip(shown, colours)
    ]
    ax.legend(
        handles=engines + times,
        loc="upper right",
        ncols=1 if narrow else 2,
        fontsize=8 if narrow else 9,
    )
    sentence = (
        "Free surface of the continuum (solid) and of the grains (dashed) at the same instants and "
        "at the end of each: where the mapped solid fraction, followed up from the floor, falls "
        "below half of the bulk's."
    )
    ends = f"At the end {deposit(mpm)} in the continuum; in the grains {deposit(dem)}."
    return figure, sentence, ends
