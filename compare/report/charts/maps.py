"""What the three maps share: one quantity, three instants, continuum and grains side by side on one
colour scale.
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib import colormaps

from cases.style import LABEL
from compare.report.charts import NARROW, WIDE, along
from compare.mapping.reductions import bulk_solid_fraction, common_frames, surface


def instants(comparison) -> list[tuple[int, int]]:
    """Frames nearest to the grains' kinetic-energy peak and to 1.8 times its time, and the last
    frame of each.
    """
    mpm, dem = comparison.first
    frames = common_frames(mpm, dem)
    peak = dem.energy_tau()[np.argmax(dem.joules("kinetic"))]
    tau = mpm.tau()
    chosen = [min(frames, key=lambda f: abs(tau[f[0]] - t)) for t in (peak, 1.8 * peak) if frames]
    return sorted({*chosen, (len(mpm.time) - 1, len(dem.time) - 1)})


def filled(run, frame, values):
    """The values where the solid fraction exceeds a quarter of the bulk's, masked elsewhere."""
    return np.ma.masked_where(
        ~(run.fields["solid_fraction"][frame] > 0.25 * bulk_solid_fraction(run)), values
    )


def reach(runs, shown) -> tuple[float, float]:
    """How far and how high the frames `shown` of the runs go [m]."""
    grid = runs[0].fields.grid
    highest = max(surface(run, frame).max() for run, frame in zip(runs, shown[0]))
    last = [
        grid.x[(run.fields["solid_fraction"][f] > 0.25 * bulk_solid_fraction(run)).any(axis=0)].max(
            initial=grid.x[0]
        )
        for pair in shown
        for run, f in zip(runs, pair)
    ]
    return max(last) + 2 * grid.spacing, 1.12 * max(grid.spacing, highest)


STILL = "#d5d8dd"  # of what lies below the scale: a colour map's own end would be a black panel


def draw_maps(comparison, narrow, values, label, norm, cmap, engines=("mpm", "dem"), still=False):
    """values(run, frame) -> (ny, nx); of the runs of `engines` only. `still`: what lies below the
    scale is at rest, and grey.
    """
    cmap = colormaps[cmap].with_extremes(under=STILL) if still else colormaps[cmap]
    chosen = [k for k, run in enumerate(comparison.first) if run.engine in engines]
    shown = [tuple(pair[k] for k in chosen) for pair in instants(comparison)]
    runs = [comparison.first[k] for k in chosen]
    length = runs[0].length
    grid = runs[0].fields.grid
    far, top = reach(runs, shown)
    width = NARROW if narrow else WIDE
    columns = 1 if narrow else len(runs) if len(runs) > 1 else len(shown)
    panel = (width - (1.0 if narrow else 2.2)) / columns * top / far + 0.42
    count = len(runs) * len(shown) // columns
    flat = narrow or count == 1  # a row of panels is too low for a scale beside it
    figure, axes = plt.subplots(
        count,
        columns,
        figsize=(width, panel * count + (0.9 if flat else 0.5)),
        squeeze=False,
        sharex=True,
        sharey=True,
        layout="constrained",
    )
    panels_shown = [(run, pair[k]) for pair in shown for k, run in enumerate(runs)]
    edges = [
        np.append(a - 0.5 * grid.spacing, a[-1] + 0.5 * grid.spacing) / length
        for a in (grid.x, grid.y)
    ]
    for ax, (run, frame) in zip(axes.ravel(), panels_shown):
        shown_values = filled(run, frame, values(run, frame))
        image = ax.pcolormesh(*edges, shown_values, norm=norm, cmap=cmap, rasterized=True)
        if why := empty(shown_values, norm if still else None):
            ax.text(0.98, 0.92, why, transform=ax.transAxes, ha="right", va="top")
        ax.set(aspect="equal", xlim=(0.0, far / length), ylim=(0.0, top / length))
        ax.grid(False)
        t = run.tau()[frame]
        when = f"t = {t:.1f} √(H/g)" if np.isfinite(t) else "at a time that is not told"
        ax.set_title(f"{LABEL[run.engine]}, {when}", loc="left")
    for ax in axes[:, 0]:
        ax.set_ylabel("$y/L_0$")
    for ax in axes[-1]:
        ax.set_xlabel(along(runs[0]))
    figure.colorbar(
        image,
        ax=axes,
        location="bottom" if flat else "right",
        label=label,
        shrink=0.9 if narrow else 0.5 if flat else 0.75,
        aspect=30,
        extend="min" if still else "neither",
    )
    return figure


def empty(values, norm) -> str:
    """Why a panel shows no colour; "" where it shows some. `norm` of a scale with something below
    it, or None.
    """
    known = np.ma.compressed(values)
    known = known[np.isfinite(known)]
    if not len(known):
        return "no value anywhere"
    return "all below the scale: at rest" if norm and known.max() < norm.vmin else ""
