"""The report's player in a browser: it moves both sides, without a network and without a fault;
without WebGL, and on paper, there is a picture.
"""

import os
import re
from pathlib import Path

import numpy as np
import pytest
from browser import NO_WEBGL, browser, started  # noqa: F401
from played import page, pair  # noqa: F401
from synthetic import DIAMETER

from compare.report import player
from compare.report.player import packing, tracks

ROOT = "document.querySelector('.player')"


def opened(browser, page, **options):  # noqa: F811
    """The page once it can be played."""
    tab = browser.open(page, **options)
    tab.wait(f"{ROOT}.dataset.ready")
    return tab


def drawn_share(tab, side: int) -> np.ndarray:
    """Which pixels (height, width) of a side are of particles; lines are left out."""
    tab.evaluate(
        "(() => { const e = document.querySelector('.player-lines'); e.checked = false;"
        "document.querySelectorAll('.player-view svg').forEach(s => s.style.opacity = 0);"
        f"{ROOT}.player.seek({ROOT}.player.t); }})()"
    )
    tab.evaluate("document.querySelectorAll('.player-view').forEach((e, i) => e.id = 'view' + i)")
    picture = tab.screenshot(f"#view{side}")
    inked = np.abs(picture - picture[3, -4]).max(axis=2) > 0.02
    inked[:2] = inked[-2:] = inked[:, :2] = inked[:, -2:] = False  # edges on part of a pixel
    return inked


def on_top(tab, selector: str) -> bool:
    """Whether an element is what is seen at its own middle."""
    return tab.evaluate(
        f"(e => {{ e.scrollIntoView({{block: 'center'}}); const r = e.getBoundingClientRect();"
        "return e.contains(document.elementFromPoint(r.x + r.width / 2, r.y + r.height / 2)); })"
        f"(document.querySelector('{selector}'))"
    )


@pytest.mark.parametrize(
    "options", [{"width": 1280}, {"width": 390}, {"width": 1280, "dark": True}], ids=str
)
def test_it_opens_without_a_fault_and_without_a_network(browser, page, options):  # noqa: F811
    tab = opened(browser, page, **options)
    assert tab.errors == [] and tab.requests == []
    assert tab.evaluate("document.documentElement.scrollWidth") <= options["width"]
    for name in ("head b", "play", "scrubber", "quantity", "lines"):  # nothing lies over it
        assert on_top(tab, f".player-{name}"), name
    for side in (0, 1):
        share = drawn_share(tab, side).mean()
        assert 0.1 < share < 0.9
    ground = tab.screenshot("#view0")[3, -4].mean()
    assert ground < 0.2 if options.get("dark") else ground > 0.8


def test_faults_and_requests_would_be_seen(browser, tmp_path):  # noqa: F811
    broken = tmp_path / "broken.html"
    broken.write_text("<script>nosuch()</script><img src='nosuch.png'>")
    tab = browser.open(broken)
    tab.wait("document.readyState === 'complete'")
    assert any("nosuch is not defined" in line for line in tab.errors)
    assert [Path(url).name for url in tab.requests] == ["nosuch.png"]


def test_the_browser_unpacks_what_was_packed(browser, page, pair):  # noqa: F811
    tab = opened(browser, page)
    found = tab.evaluate(f"Array.from({ROOT}.player.sides[1].channels.x.codes)")
    track = tracks.read(pair.dem[0], 10**9)
    box, _ = player.bounds([tracks.read(pair.mpm[0], 10**9), track], pair.dem[0])
    codes = packing.places(track.x[:, :, 0], *box[0])
    assert np.array_equal(np.reshape(found, codes.shape), codes)


@pytest.mark.parametrize("k", [0, 12, 30])
def test_particles_are_drawn_where_they_are(browser, page, pair, k):  # noqa: F811
    """The block's right and upper edge, to two pixels and what a particle's own width adds."""
    tab = opened(browser, page)
    run = pair.dem[0]
    tab.evaluate(f"{ROOT}.player.seek({float(run.time[k])!r})")
    inked = drawn_share(tab, 1)
    track = tracks.read(run, 10**9)
    _, view = player.bounds([tracks.read(pair.mpm[0], 10**9), track], run)
    scale = inked.shape[1] / (view[1] - view[0])
    right = view[0] + (1 + np.flatnonzero(inked.any(axis=0)).max()) / scale
    upper = view[3] - np.flatnonzero(inked.any(axis=1)).min() / scale
    x = run.clouds[k].x.max(axis=0) + 0.5 * DIAMETER
    assert right == pytest.approx(min(x[0], view[1]), abs=2.0 / scale)
    assert upper == pytest.approx(x[1], abs=2.0 / scale)


def test_the_scrubber_and_the_keys_move_both_sides(browser, page):  # noqa: F811
    tab = opened(browser, page)
    tab.evaluate("document.querySelector('.player-scrubber').focus()")
    tab.key("Home")
    start = [drawn_share(tab, side) for side in (0, 1)]
    tab.evaluate("document.querySelector('.player-scrubber').focus()")
    assert tab.evaluate(f"{ROOT}.player.t") == 0.0
    tab.key("ArrowRight")
    times = tab.evaluate(f"{ROOT}.player.sides[0].time")
    assert tab.evaluate(f"{ROOT}.player.t") == times[1]
    tab.key("ArrowLeft")
    assert tab.evaluate(f"{ROOT}.player.t") == 0.0
    tab.key("End")
    assert tab.evaluate(f"{ROOT}.player.t") == times[-1]
    told = tab.evaluate("document.querySelector('.player-scrubber').ariaValueText")
    assert re.fullmatch(r"0\.357 s, 5\.00 √\(H/g\)", told)
    for side in (0, 1):  # the block is twice as long
        assert (drawn_share(tab, side) != start[side]).mean() > 0.1
    tab.press(".player-scrubber", 0.5)
    assert tab.evaluate(f"{ROOT}.player.t") == pytest.approx(0.5 * times[-1], rel=0.02)
    tab.key(" ")
    assert tab.evaluate(f"{ROOT}.player.playing") is True
    tab.wait(f"{ROOT}.player.t > {0.52 * times[-1]}")
    tab.key(" ")
    assert tab.evaluate(f"{ROOT}.player.playing") is False


def test_the_cursor_moves_along_the_energies(browser, page, pair):  # noqa: F811
    tab = opened(browser, page)
    for share in (0.25, 0.75):
        tab.press(".player-energy svg", share)
        t = tab.evaluate(f"{ROOT}.player.t")
        assert t == pytest.approx(share * pair.mpm[0].time[-1], rel=0.02)
        left = "document.querySelector('.player-{}').getBoundingClientRect().left"
        cursor, chart = (tab.evaluate(left.format(name)) for name in ("cursor", "chart"))
        width = tab.evaluate("document.querySelector('.player-chart').clientWidth")
        assert cursor - chart == pytest.approx(share * width, abs=0.02 * width)
        for engine, run in (("mpm", pair.mpm[0]), ("dem", pair.dem[0])):
            words = f".player-energy[data-energy=dissipated] span.player-{engine} span"
            said = float(tab.evaluate(f"document.querySelector('{words}').textContent"))
            known = np.interp(t, run.energy["time"], run.normalised("dissipated"))
            assert said == pytest.approx(known, abs=0.002)


def test_what_is_not_known_is_grey_and_said(browser, page):  # noqa: F811
    tab = opened(browser, page)
    assert tab.evaluate("document.querySelector('option[value=regime]').disabled") is True
    tab.evaluate(f"{ROOT}.player.colourBy('pressure')")
    says = "[...document.querySelectorAll('.player-says')].map(e => e.textContent)"
    assert tab.evaluate(says) == ["", "not known, grey: the file has no contacts"]
    for side, coloured in ((0, True), (1, False)):
        inked = drawn_share(tab, side)
        pixels = tab.screenshot(f"#view{side}")[inked]
        assert (np.ptp(pixels, axis=1).max() > 0.3) is np.bool_(coloured)


def test_with_less_motion_it_steps(browser, page):  # noqa: F811
    tab = opened(browser, page, reduced=True)
    tab.evaluate("document.querySelector('.player-play').focus()")
    before = tab.evaluate(f"{ROOT}.player.drawing.drawn")
    tab.key(" ")
    seen = tab.evaluate(
        f"(async () => {{ const p = {ROOT}.player, seen = []; for (let i = 0; i < 40; ++i) {{"
        "seen.push(p.t); await new Promise(done => setTimeout(done, 40)); } return seen; })()"
    )
    times = tab.evaluate(f"{ROOT}.player.sides[0].time")
    assert set(seen) <= set(times) and 2 <= len(set(seen)) <= 5
    assert tab.evaluate(f"{ROOT}.player.drawing.drawn") - before <= 5


def test_it_does_not_start_by_itself(browser, page):  # noqa: F811
    tab = opened(browser, page)
    t = tab.evaluate(f"{ROOT}.player.t")
    tab.evaluate("new Promise(done => setTimeout(done, 300))")
    assert tab.evaluate(f"[{ROOT}.player.playing, {ROOT}.player.t]") == [False, t]


def test_it_plays_thirty_frames_a_second(browser, page):  # noqa: F811
    """Of a full page in view, each frame waited for until its pixels are there; the best of three
    seconds. Where other programs have the cores, a frame may take no more processor time than they
    would give it.
    """
    tab = opened(browser, page)
    tab.evaluate("document.querySelector('.player-live').scrollIntoView()")
    tab.evaluate(f"document.querySelector('.player-speed').value = '100'; {ROOT}.player.play(true)")
    rates, costs = [], []
    for _ in range(3):
        before = browser.cpu_seconds()
        drawn, seconds = tab.evaluate(
            f"""(async () => {{
              const {{ drawing }} = {ROOT}.player, gl = drawing.renderer.getContext();
              const start = performance.now(), before = drawing.drawn, pixel = new Uint8Array(4);
              while (performance.now() < start + 1000) {{
                await new Promise(requestAnimationFrame);
                gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
              }}
              return [drawing.drawn - before, (performance.now() - start) / 1000];
            }})()"""
        )
        rates.append(drawn / seconds)
        costs.append((browser.cpu_seconds() - before) / drawn)
    cores = len(os.sched_getaffinity(0))
    busy = os.getloadavg()[0] > cores
    print(f"{max(rates):.0f} frames a second, {1000 * min(costs):.0f} ms of processor time each")
    assert max(rates) >= 30.0 or (busy and min(costs) <= cores / 30.0)


def visible(tab, selector: str) -> bool:
    return tab.evaluate(f"document.querySelector('{selector}').getClientRects().length > 0")


def test_on_paper_there_is_a_picture(browser, page):  # noqa: F811
    tab = opened(browser, page)
    assert visible(tab, ".player-play") and not visible(tab, ".player-still")
    tab.media(paper=True)
    assert visible(tab, ".player-still") and not visible(tab, ".player-live")
    assert tab.evaluate("document.querySelector('.player-still').naturalWidth") > 600


def test_without_webgl_there_is_a_picture_and_a_line(page):  # noqa: F811
    with started(*NO_WEBGL) as running:
        tab = running.open(page)
        tab.wait(f"{ROOT}.textContent.includes('no WebGL')", 20)
        assert visible(tab, ".player-still") and not visible(tab, ".player-live")
        assert visible(tab, ".player-why")
        assert tab.errors == [] and tab.requests == []


def test_no_serious_fault_of_accessibility(browser, page):  # noqa: F811
    for options in ({"width": 1280}, {"width": 390, "dark": True}):
        assert opened(browser, page, **options).serious() == []
