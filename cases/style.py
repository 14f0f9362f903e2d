"""How figures look: the style of every chart, and the colours of the two sides.

Importing it chooses matplotlib's backend, so that figures are written and never shown, and its own
settings.
"""

import matplotlib

matplotlib.use("Agg")
matplotlib.rcdefaults()  # not what a matplotlibrc in the working folder says

MPM, DEM, INK, PAPER = "#1f5fa8", "#c8561b", "#26292e", "#ffffff"
LABEL = {"mpm": "MPM", "dem": "DEM"}
COLOUR = {"mpm": MPM, "dem": DEM}

STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 9.5,
    "axes.titlesize": 10,
    "axes.labelsize": 9.5,
    "legend.fontsize": 9,
    "axes.edgecolor": "#8a8f98",
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e6ea",
    "grid.linewidth": 0.7,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "figure.facecolor": PAPER,
    "savefig.facecolor": PAPER,
    "svg.fonttype": "path",
    "svg.hashsalt": "grainpair",
}
