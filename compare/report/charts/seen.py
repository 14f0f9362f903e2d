"""What a figure shows, read off its own artists: as a table of all its numbers, and in words.

So the data beside a figure and the text that stands for it cannot differ from what is drawn. A
series is called by its label; one that the legend leaves out has a label that begins with "_".
"""

import re
from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib.collections import LineCollection, PathCollection, PolyCollection, QuadMesh
from matplotlib.container import BarContainer

COLUMNS = ["panel", "series", "x", "low", "y", "value"]
AUTOMATIC = re.compile(r"_?child(\d+)$")
TOLD = 6  # panels, and series of a panel, that words go into
GREEK = {"sigma": "σ", "rho": "ρ", "gamma": "γ", "mu": "μ", "int": "∫", "sqrt": "√"}


def plain(text: str) -> str:
    """A label without its mathematical markup, in one line."""
    text = re.sub(r"\\mathrm\{([^}]*)\}", r"\1", text.replace("$", ""))
    text = re.sub(r"\\sqrt\{([^}]*)\}", r"√(\1)", text)
    text = re.sub(r"\\([a-z]+)", lambda found: GREEK.get(found[1], found[1]), text)
    return " ".join(re.sub(r"[{}\\]|(?<=[A-Za-zσ])_(?=[\w{])", "", text).split())


def name_of(artist, number: int) -> str:
    label = str(artist.get_label())
    return "" if AUTOMATIC.match(label) else plain(label.removeprefix("_")) or f"series {number}"


def panels_of(figure) -> list:
    """Axes that hold data: colour bars do not."""
    return [ax for ax in figure.axes if ax.get_label() != "<colorbar>" and ax.has_data()]


def title_of(ax) -> str:
    titles = [ax.get_title(loc=place) for place in ("left", "center", "right")]
    text = " ".join(one for one in titles if one)
    axes = " over ".join(one for one in (ax.get_ylabel(), ax.get_xlabel()) if one)
    return plain(text or axes)


def colours_of(figure) -> str:
    """What the colours of a figure are of, as its bar says."""
    bars = [ax for ax in figure.axes if ax.get_label() == "<colorbar>"]
    names = dict.fromkeys(plain(ax.get_ylabel() or ax.get_xlabel()) for ax in bars)
    named = [name for name in names if name]
    return f"Colours: {', '.join(named)}." if named else ""


def polygon(vertices: np.ndarray) -> dict:
    """The lower and upper edge of what `fill_between` and `stackplot` draw."""
    count = (len(vertices) - 3) // 2
    low, high = vertices[1 : count + 1], vertices[count + 2 : 2 * count + 2][::-1]
    height = high[:, 1] - low[:, 1]
    return {"x": low[:, 0], "low": low[:, 1], "y": high[:, 1], "value": height}


def columns(artist) -> dict | None:
    """The numbers of one artist; None of one that marks a place only."""
    if isinstance(artist, QuadMesh):
        corners = artist.get_coordinates()
        centre = 0.25 * (corners[1:, 1:] + corners[1:, :-1] + corners[:-1, 1:] + corners[:-1, :-1])
        values = np.ma.filled(np.ma.asarray(artist.get_array(), dtype=float), np.nan).ravel()
        known = np.isfinite(values)
        x, y = centre.reshape(-1, 2)[known].T
        return {"x": x, "y": y, "value": values[known]}
    if isinstance(artist, PathCollection):
        x, y = np.ma.filled(artist.get_offsets(), np.nan).T
        values = artist.get_array()
        return {"x": x, "y": y} | ({} if values is None else {"value": np.asarray(values)})
    if isinstance(artist, PolyCollection):
        paths = artist.get_paths()
        return polygon(paths[0].vertices) if paths and len(paths[0].vertices) > 4 else None
    if isinstance(artist, LineCollection):
        ends = np.array(artist.get_segments()).reshape(-1, 4)
        return {"x": ends[:, 2], "low": ends[:, 1], "y": ends[:, 3]}
    return {"x": np.asarray(artist.get_xdata(orig=False)), "y": np.asarray(artist.get_ydata())}


def series_of(ax) -> Iterator[tuple[str, object, pd.DataFrame]]:
    """(name, artist, its numbers) of all that is drawn into axes to the data's own scale."""
    for number, artist in enumerate([*ax.lines, *ax.collections], start=1):
        known = isinstance(artist, (QuadMesh, PathCollection, PolyCollection, LineCollection))
        if not known and artist not in ax.lines:
            continue
        if artist in ax.lines and artist.get_transform() != ax.transData:
            continue  # a line across the whole panel
        if artist in ax.lines and artist.get_label() == "_nolegend_":
            continue  # the cap of an error bar
        found = columns(artist)
        if found is not None and len(found["x"]):
            table = pd.DataFrame(found).dropna(how="all")
            yield name_of(artist, number) or f"series {number}", artist, table
    for box in ax.containers:
        if isinstance(box, BarContainer):
            rows = [{"x": p.get_x() + p.get_width(), "y": p.get_y()} for p in box.patches]
            yield str(box.get_label()).removeprefix("_"), box, pd.DataFrame(rows)


def table(figure) -> pd.DataFrame:
    """Every number of a figure, a row each: panel, series, x, y; `low` where a series has a lower
    edge, `value` where it is coloured by one, or the height of a band.
    """
    found = []
    for ax in panels_of(figure):
        for name, _, numbers in series_of(ax):
            found.append(numbers.assign(panel=title_of(ax), series=name))
    if not found:
        return pd.DataFrame(columns=COLUMNS)
    whole = pd.concat(found, ignore_index=True).reindex(columns=COLUMNS)
    return whole.dropna(axis="columns", how="all")


def words(figure) -> str:
    """What is to be seen in each panel, with its numbers."""
    told = [one for one in (colours_of(figure),) if one]
    for ax in panels_of(figure)[:TOLD]:
        seen = list(series_of(ax))
        if seen:
            title = title_of(ax)
            told.append(f"{title + ': ' if title else ''}{panel(ax, seen)}.")
    left = len(panels_of(figure)) - TOLD
    return " ".join(told) + (f" {left} more panels." if left > 0 else "")


def panel(ax, seen: list) -> str:
    curves = [one for one in seen if one[1] in ax.lines and len(one[2]) > 1]
    if 0 < len(curves) <= TOLD:
        return "; ".join(curve(name, numbers) for name, _, numbers in curves)
    bands = [one for one in seen if isinstance(one[1], PolyCollection)]
    tops = [one for one in bands if not one[0].startswith("series")]
    if tops and not curves:
        ends = (
            name if name.endswith("%") else f"{name} {edge(numbers):.3g}"
            for name, _, numbers in tops
        )
        return "at the end " + ", ".join(ends)
    coloured = [one[2]["value"].dropna() for one in seen if "value" in one[2]]
    values = pd.concat(coloured) if coloured else pd.Series(dtype=float)
    if len(values):
        return (
            f"values from {values.min():.3g} to {values.max():.3g}, in the mean "
            f"{values.mean():.3g}"
        )
    every = pd.concat([one[2] for one in seen])
    return (
        f"{len(seen)} series or marks, x from {every['x'].min():.3g} to {every['x'].max():.3g}, y "
        f"from {every['y'].min():.3g} to {every['y'].max():.3g}"
    )


def edge(numbers: pd.DataFrame) -> float:
    return float(numbers["value"].iloc[-1])


def curve(name: str, numbers: pd.DataFrame) -> str:
    """Start, extreme and end of a curve."""
    known = numbers.dropna(subset=["y"])
    if known.empty:
        return f"{name} without a value"
    y, x = known["y"].to_numpy(), known["x"].to_numpy()
    most = int(np.argmax(y))
    peak = f", at most {y[most]:.3g} at {x[most]:.3g}" if 0 < most < len(y) - 1 else ""
    return f"{name} from {y[0]:.3g} at {x[0]:.3g}{peak} to {y[-1]:.3g} at {x[-1]:.3g}"
