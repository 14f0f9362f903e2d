"""Pages look as they did: report, player, site and the pages of studies, at a desk, on a phone, in
the dark and on paper, against pictures in tests/data/faces.

    GRAINPAIR_FACES=draw /usr/bin/python3 -m pytest tests/py/test_faces.py

draws these anew; look at them before they are committed. Nothing but the pages' look is asked for
here: what they say, tests of their own do.
"""

import importlib.util
import os
import re
from pathlib import Path

import faces
import looks
import pytest
from browser import Browser, Page, browser  # noqa: F401

DRAW = os.environ.get("GRAINPAIR_FACES") == "draw"


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The path of a page by its name, written when it is first asked for."""
    folder, paths = tmp_path_factory.mktemp("faces"), {}

    def get(name: str) -> Path:
        if name in faces.SITE and not all(map(importlib.util.find_spec, ("sphinx", "myst_parser"))):
            pytest.skip("packages-docs.txt is not installed")
        if name not in paths:
            paths[name] = faces.make(name, folder)
        return paths[name]

    return get


def opened(browser: Browser, path: Path) -> Page:  # noqa: F811
    """A page, without a fault and without a request to anywhere but its own site."""
    tab = browser.open(path)
    if tab.evaluate("Boolean(document.querySelector('.player'))"):
        tab.wait("document.querySelector('.player').dataset.ready")
    # a page of the site has its styles and scripts beside it
    elsewhere = [one for one in tab.requests if "/site/" not in one or not one.startswith("file:")]
    assert tab.errors == [] and elsewhere == []
    return tab


def test_pages_of_trials_say_no_more_the_second_time(tmp_path, written):
    """What one page adds to its charts' words is its own."""
    first, second = written("judge"), faces.make("judge", tmp_path)
    assert said(second) == said(first)


def said(page: Path) -> str:
    """What its charts say."""
    return "".join(re.findall(r"<li>.*?</li>", page.read_text(), re.DOTALL))


@pytest.mark.parametrize("name", faces.PAGES)
def test_a_page_looks_as_it_did(browser, written, name, tmp_path):  # noqa: F811
    tab, wrong = opened(browser, written(name)), []
    for view in looks.VIEWS:
        if view == "print" and not looks.can_print():
            continue
        picture = looks.look(tab, view)
        width = tab.evaluate("document.documentElement.scrollWidth")
        assert width == looks.VIEWS[view]["width"], view
        reference, shown = faces.DATA / f"{name}-{view}.png", tmp_path / f"{name}-{view}.png"
        looks.keep(picture, shown)
        if DRAW:
            looks.keep(picture, reference)
        if said := looks.difference(picture, looks.kept(reference)):
            wrong.append(f"{shown}: {said} ({reference.relative_to(faces.ROOT)})")
    assert tab.errors == [] and not wrong, "\n".join(wrong)


@pytest.mark.parametrize("name", faces.PAGES)
def test_no_page_has_a_serious_fault_of_accessibility(browser, written, name):  # noqa: F811
    tab = opened(browser, written(name))
    for view in ("390", "dark"):
        looks.show(tab, view)
        assert tab.serious() == [], view


def test_a_serious_fault_of_accessibility_is_seen(browser, written):  # noqa: F811
    tab = opened(browser, written("docs"))
    tab.evaluate("document.querySelector('main img').removeAttribute('alt')")
    tab.evaluate("document.querySelector('main p').style.color = '#999'")
    assert {one[0] for one in tab.serious()} == {"image-alt", "color-contrast"}


ALL = "document.querySelectorAll"
BROKEN = {
    "a figure that is not shown": f"{ALL}('figure')[0].style.visibility = 'hidden'",
    "a figure that is gone": f"{ALL}('figure')[0].remove()",
    "no style": f"{ALL}('style')[0].remove()",
    "dark words on a dark page": "document.documentElement.style.setProperty('--ink', '#26292e')",
    "a figure without words": f"{ALL}('figure svg text').forEach(one => one.textContent = '')",
    "a squeezed table": f"{ALL}('table').forEach(one => one.style.width = '300px')",
    "a column that is cut off": f"{ALL}('td:last-child').forEach(one => one.textContent = '')",
}


@pytest.mark.parametrize("fault", BROKEN)
def test_a_page_that_is_broken_is_seen(browser, written, fault):  # noqa: F811
    tab, reference = opened(browser, written("ladder")), faces.DATA / "ladder-dark.png"
    assert looks.difference(looks.look(tab, "dark"), looks.kept(reference)) == ""
    tab.evaluate(f"{BROKEN[fault]}; 0")
    assert looks.difference(looks.look(tab, "dark"), looks.kept(reference))
