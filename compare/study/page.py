"""A study as one HTML file: its figures, in which every point tells its recipe, and its tables."""

import math
from pathlib import Path

import jinja2
import pandas as pd

from cases.files import write_atomically

Figure = tuple[str, list[str], str]  # heading, sentences, SVG or ""


def shown(cell) -> str:
    if isinstance(cell, float):
        return "–" if math.isnan(cell) else f"{cell:.3g}"
    return str(cell)


def write(
    path: Path,
    title: str,
    origin: dict,
    figures: list[Figure],
    tables: dict[str, pd.DataFrame],
):
    """The last column of a table is set as code."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent), autoescape=True, trim_blocks=True
    )
    environment.filters["number"] = shown
    write_atomically(
        path,
        environment.get_template("page.html.j2").render(
            title=title,
            origin=origin,
            figures=[
                (heading, words, svg[svg.index("<svg") :] if svg else "")
                for heading, words, svg in figures
            ],
            tables=[
                (heading, list(table), table.to_numpy().tolist())
                for heading, table in tables.items()
            ],
        ),
    )
