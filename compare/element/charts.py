"""What the figures of the element tests share: `draw(rows, models, path)` of each draws with it."""

from functools import wraps
from pathlib import Path

import matplotlib.pyplot as plt

from cases.files import write_figure
from cases.style import STYLE
from compare.element.model import Law

CARD_LINES = ("--", "-", ":", "-.")


def styled(draw):
    """Lets `draw` run in the project's figure style."""

    @wraps(draw)
    def drawn(*arguments):
        with plt.rc_context(STYLE):
            return draw(*arguments)

    return drawn


def colours(count: int, name: str = "viridis"):
    """`count` distinguishable colours in order."""
    return [plt.get_cmap(name)(0.05 + 0.85 * i / max(count - 1, 1)) for i in range(count)]


def line_styles(models: dict[str, Law]) -> dict[str, str]:
    """A line style per card, in the order the cards were named."""
    return dict(zip(models, CARD_LINES))


def card_legend(axes, models: dict[str, Law], dem: str = "DEM") -> None:
    """A legend that tells DEM markers from the cards' lines."""
    handles = [plt.Line2D([], [], color="0.3", linestyle="none", marker="o", markersize=4)]
    handles += [
        plt.Line2D([], [], color="0.3", linestyle=style) for style in line_styles(models).values()
    ]
    axes.add_artist(axes.legend(handles, [dem, *models], loc="best", fontsize=8))


def save(figure, path: Path) -> list[Path]:
    """Writes the figure as PNG and SVG beside each other (atomically) and closes it."""
    files = []
    for ending in ("png", "svg"):
        file = path.with_name(f"{path.name}.{ending}")
        metadata = {"Date": None} if ending == "svg" else None
        write_figure(file, figure, dpi=150, metadata=metadata)
        files.append(file)
    plt.close(figure)
    return files
