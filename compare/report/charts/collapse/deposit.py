import matplotlib.pyplot as plt
import numpy as np
from matplotlib import colormaps
from matplotlib.colors import ListedColormap

from cases.style import INK
from compare.report.charts import NARROW, WIDE, chart
from compare.report.charts.collapse import instants, reach, scatter, when
from compare.metrics.final_height import final_height
from compare.metrics.run_out import run_out
from compare.mapping.reductions import surface

FIFTHS = ListedColormap(["#26292e", "#1f5fa8", "#7fb2e5", "#f0b429", "#c8321b"])


@chart("The deposit", order=10)
def deposit(run, narrow):
    far, top = reach(run)
    inches = (NARROW if narrow else 0.72 * WIDE) - 0.6
    figure, axes = plt.subplots(
        2,
        1,
        figsize=(inches + 0.6, 2.0 * (inches * top / far + 0.6)),
        layout="constrained",
        sharex=True,
    )
    frames = [0, *instants(run)]
    x = run.fields.grid.x / run.length
    for frame, colour in zip(frames, colormaps["viridis"](np.linspace(0.0, 0.85, len(frames)))):
        axes[0].plot(x, surface(run, frame) / run.length, color=colour, label=when(run, frame))
    axes[0].legend(fontsize=7 if narrow else 8)
    axes[0].set(aspect="equal", ylim=(0.0, top))
    fifth = np.floor(5.0 * run.clouds[0].x[:, 1] / run.height).clip(0, 4)
    scatter(axes[1], run, -1, fifth, inches, cmap=FIFTHS)
    axes[1].plot(x, surface(run, -1) / run.length, color=INK, lw=1.0)
    for ax, title in zip(axes, ("free surface", "at the end, by fifths of the height at release")):
        ax.set(ylabel="$y/L_0$")
        ax.set_title(title, loc="left")
    axes[1].set_xlabel("$x/L_0$")
    still = "is at rest" if run.attributes.get("end_reason") == "rest" else "has not come to rest"
    width = 1000.0 * run.fields.values.file.attrs["width"]
    return figure, (
        f"Beyond the paper, which stops before the deposit: at {run.tau()[-1]:.2f} √(H/g) the mass "
        f"{still}. Run-out {run_out(run):.3f} L0 (99.5 % of the mass), height "
        f"{final_height(run):.3f} L0: of the free surface, where the solid fraction falls below "
        f"half the bulk's, mapped with a kernel as wide as a cell ({width:.1f} mm), so that points "
        "drawn apart leave no gaps."
    )
