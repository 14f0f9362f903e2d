"""A study as one HTML file: its figures, in which every point tells its recipe, and its tables."""

from pathlib import Path

import pandas as pd

from cases.files import write_atomically
from compare.report import page as pages

# heading, sentences, and what is drawn; None where nothing could be
Figure = tuple[str, list[str], pages.Picture | None]


def write(
    path: Path,
    title: str,
    origin: dict,
    figures: list[Figure],
    tables: dict[str, pd.DataFrame],
):
    """The last column of a table is set as code where it is text; columns that tell nothing are
    left out.
    """
    shown = [
        {
            "heading": heading,
            "words": words,
            "picture": picture,
            "data": picture and pages.data_of(picture.table),
        }
        for heading, words, picture in figures
    ]
    headings = [(f"figure-{i}", one["heading"]) for i, one in enumerate(shown, start=1)]
    headings += [(f"table-{i}", heading) for i, heading in enumerate(tables, start=1)]
    write_atomically(
        path,
        pages.render(
            Path(__file__).with_name("study.html.j2"),
            title=title,
            origin=origin,
            contents=headings,
            figures=shown,
            tables=[
                (heading, list(table), table.astype(object).to_numpy().tolist())
                for heading, table in ((name, told(one)) for name, one in tables.items())
            ],
        ),
    )


def told(table: pd.DataFrame) -> pd.DataFrame:
    """The columns of a table that hold something; all where it has no rows."""
    empty = (table.isna() | (table.astype(str) == "")).all() & (len(table) > 0)
    return table.loc[:, ~empty]
