"""What the two maps of dissipation share."""

import numpy as np
from matplotlib.colors import Normalize

from compare.report.charts.collapse import colour_bar, draw_points


def draw_dissipation(run, narrow, kind: str):
    scale = run.case["geometry.gravity"] * run.height
    record = f"{kind}_dissipation"
    top = np.quantile(run.clouds[-1].state[record], 0.98) / scale
    figure, axes, artist = draw_points(
        run,
        narrow,
        lambda frame: run.clouds[frame].state[record] / scale,
        "inferno",
        Normalize(0.0, max(top, 1e-12), clip=True),
    )
    colour_bar(
        figure, axes, artist, f"specific {kind.replace('_', ' ')} dissipation $/gH$", extend="max"
    )
    return figure
