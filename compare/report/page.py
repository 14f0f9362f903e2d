"""The one HTML page that all that is written stands on: page.html.j2 with page.css, which a
template of ours extends. Everything is in the file: no script, no font, no address.
"""

import base64
import math
from dataclasses import dataclass
from pathlib import Path

import jinja2
import pandas as pd

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Data:
    """What a figure shows as a link that saves a CSV file, and how many rows it has."""

    link: str
    rows: int


@dataclass(frozen=True)
class Picture:
    """A figure that a page holds in itself: the SVG, which says as `alt` what is to be seen, and
    the table of what it shows.
    """

    name: str
    svg: str
    alt: str
    table: pd.DataFrame


def data_of(table: pd.DataFrame) -> Data:
    text = table.to_csv(index=False, float_format="%.5g")
    return Data("data:text/csv;base64," + encoded(text), len(table))


def tall(figure) -> bool:
    """Whether a figure is so high that paper has no room for two of its kind."""
    width, height = figure.get_size_inches()
    return bool(height > 0.8 * width)


def encoded(text: str) -> str:
    return base64.b64encode(text.encode()).decode()


def number(cell) -> str:
    """As tables show it; text as it is."""
    if cell is None:
        return "–"
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    if isinstance(cell, float):
        return f"{cell:.4g}" if math.isfinite(cell) else "–"
    return str(cell)


def percent(x: float | None) -> str:
    return "–" if x is None else f"{100 * x:+.1f} %"


def render(template: Path, **values) -> str:
    """The page of a template, which lies beside page.html.j2 or anywhere else. `contents` are
    (id, words) of the headings that the list at its top leads to.
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader([template.parent, HERE]),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"number": number, "percent": percent}
    return environment.get_template(template.name).render(**values)
