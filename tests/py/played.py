"""A pair of runs with as many particles as column_small has, and a page with its player alone."""

from pathlib import Path

import h5py
import jinja2
import numpy as np
import pytest
from synthetic import write_pair

from compare.mapping.runs import map_fields
from compare.report import player
from compare.verdict import comparison

PAGE = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Player</title>
<meta name="viewport" content="width=device-width, initial-scale=1"><link rel="icon" href="data:,">
<style>main {max-width: 1008px; margin: auto}</style></head>
<body><main><h1>Player</h1>{% include "player/player.html.j2" %}</main></body></html>"""


def mapped(folder: Path) -> comparison.Comparison:
    map_fields([folder / "mpm.h5", folder / "dem.h5"], folder / "fields.h5")
    return comparison.load(folder)


def page_of(built: player.Player, path: Path) -> Path:
    """A page with nothing but the player."""
    loader = jinja2.FileSystemLoader(Path(player.__file__).parents[1])
    environment = jinja2.Environment(loader=loader, autoescape=True)
    path.write_text(environment.from_string(PAGE).render(player=built))
    return path


def rewrite(group: h5py.Group, count: int, order: np.ndarray):
    """Takes the rows `order` of every record below a group."""
    for name, thing in list(group.items()):
        if "shape" in thing.attrs:
            thing.attrs["shape"] = np.array([len(order)], np.uint64)
        elif isinstance(thing, h5py.Group):
            rewrite(thing, count, order)
        elif thing.shape == (count,):
            values, attributes = thing[()][order], dict(thing.attrs)
            del group[name]
            group[name] = values
            group[name].attrs.update(attributes)


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """1600 points in one plane and 3125 grains, 31 frames: what a report of column_small has."""
    scene = {"frames": 31, "height": 0.05, "length": 0.05, "thickness": 0.01}
    folder = write_pair(
        tmp_path_factory.mktemp("pair"), mpm=scene, dem=scene | {"stretch": 2.1, "seed": 2}
    )
    with h5py.File(folder / "mpm.h5", "a") as f:
        layers = 8  # 0.01/0.00125, of which the first is kept, with the mass of all
        for frame in f["data"].values():
            cloud = frame["particles/cloud"]
            count = len(cloud["mass"])
            rewrite(cloud, count, np.arange(0, count, layers))
            for name in ("mass", "solid_volume"):
                cloud[name][...] = layers * cloud[name][()]
    return mapped(folder)


@pytest.fixture(scope="module")
def page(pair, tmp_path_factory):
    return page_of(player.build(pair), tmp_path_factory.mktemp("page") / "player.html")
