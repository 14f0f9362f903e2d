"""The site of the documentation, and the picture of the README."""

import html.parser
import importlib.util
import re
import tomllib
from pathlib import Path
from urllib.parse import unquote

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
from browser import browser  # noqa: F401
from matplotlib import image

from cases.errors import CaseError
from cases.programs import ROOT, call, module
from compare.pages import reference, site, surfaces
from compare.parsers import all_commands

# Of the mean difference of two pictures, from 0 to 1. The same libraries draw the same (0); other
# versions of FreeType change the edges of letters by shades, which cover a few per cent; surfaces
# that are a twentieth of the height off make 0.01.
TOLERANCE = 0.005


def difference(figure, picture: Path, folder: Path) -> float:
    figure.savefig(folder / "new.png", dpi=100)
    plt.close(figure)
    new, old = image.imread(folder / "new.png"), image.imread(picture)
    return float(np.mean(abs(new - old))) if new.shape == old.shape else 1.0


def test_the_picture_of_the_readme_is_that_of_its_table(tmp_path):
    table = pd.read_csv(surfaces.TABLE, comment="#")
    assert "docs/pictures/collapse.png" in (ROOT / "README.md").read_text()
    assert difference(surfaces.draw(table), surfaces.PICTURE, tmp_path) < TOLERANCE


def test_a_picture_of_another_table_is_noticed(tmp_path):
    """A twentieth of the column's height, of the grains alone."""
    table = pd.read_csv(surfaces.TABLE, comment="#")
    other = table.assign(grains=(table["grains"] - 0.05).clip(lower=0.0))
    assert difference(surfaces.draw(other), surfaces.PICTURE, tmp_path) > TOLERANCE


@pytest.mark.slow
def test_the_table_is_that_of_the_default_command(tmp_path):
    """To a hundredth of the column's length on average: room for another compiler's round-off; here
    it is 1e-5. A surface that is a twentieth too low is 0.017 off.
    """
    done = call(module("compare.__main__", "run", "--quiet", "--no-siblings", "--out", tmp_path))
    assert done.returncode == 0, done.stderr
    now, table = surfaces.table_of(tmp_path), pd.read_csv(surfaces.TABLE, comment="#")
    assert len(now) == len(table)
    for side in ("continuum", "grains"):
        off = now[side].to_numpy() - table[side].to_numpy()
        lower = 0.05 * (table[side].to_numpy() > 0.0)
        assert np.mean(abs(off)) < 0.01 < np.mean(abs(off - lower)), side


def test_every_key_metric_and_command_has_a_place():
    text = reference.keys()
    for file, _ in reference.SCHEMAS.values():
        schema = tomllib.loads((ROOT / "cases" / file).read_text())
        found = dict(reference.entries({k: v for k, v in schema.items() if k != "former"}))
        assert found and all(f"| `` {name} `` |" in text for name in found), file
    row = next(line for line in text.splitlines() if "`` mpm.cell_size ``" in line)
    assert "| m |" in row and "1e-05 to 1" in row and "**required**" in row
    metrics = {file.stem for file in (ROOT / "compare" / "metrics").glob("[a-z]*.py")}
    assert all(f"`` {name} ``" in reference.metrics() for name in metrics)
    told = reference.commands()
    assert all(f"## {name}\n" in told for name in all_commands())
    assert "`` --seeds N ``" in told and "energy-growth" in reference.failures()


class Links(html.parser.HTMLParser):
    """What a page links to, what it loads, and its own anchors."""

    def __init__(self, text: str):
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        words = dict(attrs)
        self.anchors.add(words.get("id") or "")
        if tag == "a":
            self.links.append(words.get("href") or "")
        elif words.get("src") or (tag == "link" and words.get("rel") != "canonical"):
            self.loaded.append(words.get("src") or words.get("href") or "")


def faults(folder: Path) -> list[str]:
    """Links of a site that lead nowhere, and what its pages load from elsewhere."""
    pages = {file: Links(file.read_text()) for file in folder.rglob("*.html")}
    wrong = []
    for file, page in pages.items():
        for target in [*page.links, *page.loaded]:
            if re.match(r"(https?:|mailto:|data:)", target):
                if target in page.loaded and not target.startswith("data:"):
                    wrong.append(f"{file}: loads {target}")
                continue
            name, _, anchor = target.partition("#")
            to = (file.parent / unquote(name.partition("?")[0])).resolve() if name else file
            if not to.exists():
                wrong.append(f"{file}: {target}: no such file")
            elif anchor and to in pages and unquote(anchor) not in pages[to].anchors:
                wrong.append(f"{file}: {target}: no such anchor")
    for style in folder.rglob("*.css"):
        wrong += [
            f"{style}: {one}" for one in re.findall(r"url\(.?https?:[^)]*", style.read_text())
        ]
    return wrong


def need_sphinx():
    if not all(map(importlib.util.find_spec, ("sphinx", "myst_parser"))):
        pytest.skip("packages-docs.txt is not installed")


@pytest.fixture(scope="module")
def built(tmp_path_factory) -> Path:
    if (
        importlib.util.find_spec("sphinx") is None
        or importlib.util.find_spec("myst_parser") is None
    ):
        pytest.skip("packages-docs.txt is not installed")
    out = tmp_path_factory.mktemp("site")
    site.build(out)
    return out


def test_the_site_is_whole_and_needs_no_network(built):
    assert faults(built) == []
    for page in site.pages():
        assert (built / page.with_suffix(".html")).exists(), page
    for name in reference.PAGES:
        assert (built / site.MADE / f"{name}.html").exists(), name
    told = (built / site.MADE / "commands.html").read_text()
    assert "Written to --out" in told  # as it is typed
    words = (built / "searchindex.js").read_text()
    assert (
        words.startswith("Search.setIndex(") and "reference/keys" in words
    )  # a script: file:// too


def test_what_is_wrong_with_a_site_is_seen(tmp_path):
    (tmp_path / "a.html").write_text(
        '<a href="b.html">b</a><a href="#c">c</a><p id="f">'
        '<script src="https://d.org/e.js"></script>'
    )
    (tmp_path / "a.css").write_text("@font-face { src: url('https://g.org/h.woff') }")
    assert len(faults(tmp_path)) == 4
    (tmp_path / "b.html").write_text('<a href="a.html#f">f</a>')
    assert len(faults(tmp_path)) == 3


def test_a_link_to_no_file_and_a_warning_of_sphinx_are_refused(tmp_path, monkeypatch):
    clone = tmp_path / "clone"
    (clone / "docs" / "reference").mkdir(parents=True)
    (clone / "docs" / "reference" / "index.md").write_text("# Reference\n")
    (clone / "docs" / "folders.md").write_text("# Folders\n")
    (clone / "docs" / "index.md").write_text("# Start\n\n[lost](nowhere.png)\n")
    monkeypatch.setattr(site, "ROOT", clone)
    with pytest.raises(CaseError, match="nowhere.png"):
        site.stage(tmp_path / "one")
    if (
        importlib.util.find_spec("sphinx") is None
        or importlib.util.find_spec("myst_parser") is None
    ):
        pytest.skip("packages-docs.txt is not installed")
    listed = "\n```{toctree}\nreference/index\nfolders\n```\n"
    (clone / "docs" / "index.md").write_text("# Start\n" + listed)
    (clone / "cases").mkdir()
    (clone / "cases" / "README.md").write_text("# Cases\n")
    site.build(tmp_path / "out")
    (clone / "docs" / "index.md").write_text("# Start\n\n[lost](nowhere.md)\n" + listed)
    with pytest.raises(CaseError, match="nowhere"):
        site.build(tmp_path / "again")


def fits(browser, page: Path, **media) -> bool:  # noqa: F811
    """Whether a page is no wider than a phone; it says nothing wrong and asks for nothing but what
    lies in the site.
    """
    tab = browser.open(page, width=390, **media)
    assert tab.errors == [] and not [one for one in tab.requests if not one.startswith("file:")]
    return tab.evaluate("document.documentElement.scrollWidth") == 390


def test_every_page_fits_a_phone(browser, built):  # noqa: F811
    pages = [page.with_suffix(".html") for page in site.pages()]
    pages += [site.MADE / f"{name}.html" for name in reference.PAGES] + [Path("search.html")]
    assert [page for page in pages if not fits(browser, built / page)] == []


def test_a_page_that_is_too_wide_is_seen(browser, tmp_path):  # noqa: F811
    wide = tmp_path / "wide.html"
    wide.write_text("<meta name=viewport content=width=device-width><pre>" + "wide " * 200)
    assert not fits(browser, wide)


PAGES = ("docs/index", "docs/theory/model", "docs/tutorials/first_pair", "RESULTS", "search")


@pytest.mark.parametrize("name", PAGES)
def test_the_site_has_no_serious_fault_of_accessibility(browser, built, name):  # noqa: F811
    for media in ({"width": 1280}, {"width": 390, "dark": True}):
        assert browser.open(built / f"{name}.html", **media).serious() == []


def brightness(picture: np.ndarray) -> float:
    return float(np.median(picture))


@pytest.mark.parametrize("name", ("docs/index", "RESULTS"))
def test_a_page_in_the_dark_is_dark_and_its_figures_are_not(browser, built, name):  # noqa: F811
    tab = browser.open(built / f"{name}.html", dark=True)
    assert brightness(tab.screenshot()) < 0.2
    for number in range(tab.evaluate("document.querySelectorAll('main img').length")):
        tab.evaluate(f"document.querySelectorAll('main img')[{number}].id = 'one'")
        assert brightness(tab.screenshot("#one")) > 0.8
        tab.evaluate("document.querySelector('#one').id = ''")
    tab.media()
    assert brightness(tab.screenshot()) > 0.8


def test_every_figure_says_what_is_seen(built):
    """With a number or in ten words at least: more than a title."""
    found = 0
    for page in site.pages():
        for text in re.findall(r"!\[([^\]]*)\]\(", (ROOT / page).read_text()):
            found += 1
            assert len(text.split()) >= 10, f"{page}: {text}"
    assert found >= 12
