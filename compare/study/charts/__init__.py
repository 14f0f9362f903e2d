"""Charts of studies, one file each. Here what they share: points that tell what they are, and
saving.
"""

import io
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd

from cases.files import write_atomically, write_figure
from cases.style import STYLE
from compare.report.charts import seen
from compare.report.page import Picture, tall

SVG = "http://www.w3.org/2000/svg"
STUDY_STYLE = STYLE | {"svg.fonttype": "none"}
LARGEST = 1.15  # of its own size: beyond, the letters of a small figure outgrow the page's


def save(
    figure,
    path: Path,
    tips: dict[str, str],
    table: pd.DataFrame | None = None,
    alt: str = "",
) -> Picture:
    """Writes the figure as PNG and SVG; `tips` are shown where the pointer rests on the artist of
    that gid. What `table` and `alt` do not tell is read off the figure.
    """
    alt = alt or seen.words(figure)
    table = seen.table(figure) if table is None else table
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None})
    write_figure(path.with_suffix(".png"), figure, dpi=130)
    plt.close(figure)
    ElementTree.register_namespace("", SVG)
    ElementTree.register_namespace("xlink", "http://www.w3.org/1999/xlink")
    root = ElementTree.fromstring(buffer.getvalue())
    for group in root.iter(f"{{{SVG}}}g"):
        if (gid := group.get("id", "")) in tips:
            title = ElementTree.Element(f"{{{SVG}}}title")
            title.text = tips[gid]
            group.insert(0, title)
    root.set("role", "img")
    root.set("aria-label", alt)
    root.set("class", "tall" if tall(figure) else "")
    root.set("style", f"max-width: {LARGEST * figure.get_figwidth():.4g}in")
    for metadata in root.findall(f"{{{SVG}}}metadata"):
        root.remove(metadata)
    text = ElementTree.tostring(root, encoding="unicode")
    write_atomically(path.with_suffix(".svg"), text)
    return Picture(path.stem, text[text.index("<svg") :], alt, table)
