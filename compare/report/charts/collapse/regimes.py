import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap

from compare.report.charts import chart
from compare.report.charts.collapse import colour_bar, draw_points

COLOURS = ("#e3e5e9", "#1f5fa8", "#4fb0c6", "#f0b429", "#c8321b")
WORDS = ("0 none", "1 visco-\nelastic", "2 visco-elasto-\nplastic", "3 critical", "4 collisional")


@chart("Regimes", order=8)
def regimes(run, narrow):
    figure, axes, artist = draw_points(
        run,
        narrow,
        lambda frame: run.clouds[frame].state["regime"],
        ListedColormap(COLOURS),
        BoundaryNorm(np.arange(6) - 0.5, 5),
    )
    bar = colour_bar(figure, axes, artist, "")
    bar.set_ticks(range(5), labels=WORDS, fontsize=8)
    bar.ax.tick_params(length=0)
    return figure, (
        "Regime of every point [Ceccato2019, section 2.3] (compare its Figure 8). 0 is a point "
        "without contacts below the critical void ratio, which the paper's four regimes do not "
        "name."
    )
