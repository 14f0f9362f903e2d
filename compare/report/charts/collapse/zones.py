import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap

from compare.report.charts import chart
from compare.report.charts.collapse import colour_bar, draw_points, instants
from compare.mapping.mobilised import INSIDE, STATIC, SURFACE, WORDS, shares, thickness
from compare.mapping.mobilised import zones as zones_of


@chart("Where it slides and where it flows", order=4)
def zones(run, narrow):
    layer = thickness(run)
    figure, axes, artist = draw_points(
        run,
        narrow,
        lambda frame: zones_of(run, frame, layer),
        ListedColormap(["#b9c0cb", "#c8561b", "#7fb2e5"]),
        BoundaryNorm(np.arange(4) - 0.5, 3),
        frames=instants(run)[:-1],
    )
    bar = colour_bar(figure, axes, artist, "")
    bar.set_ticks(
        [STATIC, SURFACE, INSIDE],
        labels=[
            word.replace(" and base", "\nand base").replace("mobilised", "\nmobilised")
            for word in WORDS
        ],
    )
    bar.ax.tick_params(length=0)
    bar.outline.set_visible(False)
    found = {
        kind: shares(run, f"{kind}_dissipation", layer).found for kind in ("plastic", "regime_4")
    }
    words = "; ".join(
        f"of the {kind.replace('_', ' ')} dissipation {share[SURFACE]:.2f} in the layers and "
        f"{share[INSIDE]:.2f} inside"
        for kind, share in found.items()
    )
    return figure, (
        f"The zones in which the statements above count dissipation: layers of {1000 * layer:.0f} "
        "mm where mobilised points (faster than 0.01 √(gH)) meet points at rest or the floor, the "
        f"mobilised mass inside them, and what is at rest. Over the whole run, {words}."
    )
