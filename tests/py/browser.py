"""Debian's chromium, headless, driven by its DevTools protocol: what a page shows, says and asks
for.

`with started() as browser:` skips the test where chromium or python3-websocket is missing (both of
packages-check.txt). A page is opened from its file; graphics are software's (SwiftShader) and all
letters DejaVu's, so that a page depends neither on the machine's card nor on its fonts. As a
fixture of a module:

    from browser import browser  # noqa: F401
    def test_…(browser): page = browser.open(path, width=390, dark=True)
"""

import base64
import io
import itertools
import json
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import numpy as np
import pytest
from matplotlib.font_manager import findfont
from matplotlib.image import imread

from cases import children
from cases.scratch import temporary

CHROMIUM = "/usr/bin/chromium"
SOFTWARE = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
NO_WEBGL = ("--disable-3d-apis",)
QUIET = (
    "--headless=new",
    "--no-sandbox",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-default-apps",
    "--disable-extensions",
    "--disable-sync",
    "--force-color-profile=srgb",
    "--hide-scrollbars",
    "--remote-debugging-port=0",
)
# Of fontconfig: the fonts that matplotlib draws with, and no others.
FONTS = """<?xml version="1.0"?><!DOCTYPE fontconfig SYSTEM "fonts.dtd">
<fontconfig><dir>{fonts}</dir><cachedir>{cache}</cachedir>
<match><test name="family" compare="contains"><string>mono</string></test>
<edit name="family" mode="assign" binding="strong"><string>DejaVu Sans Mono</string></edit></match>
<match><test name="family" compare="not_contains"><string>ono</string></test>
<edit name="family" mode="assign" binding="strong"><string>DejaVu Sans</string></edit></match>
</fontconfig>
"""
PATIENCE = 60.0  # [s] for an answer; the machine may be busy
KEYS = {" ": ("Space", 32), "ArrowLeft": ("ArrowLeft", 37), "ArrowRight": ("ArrowRight", 39)}
KEYS |= {"Home": ("Home", 36), "End": ("End", 35), "Tab": ("Tab", 9)}


class Page:
    """One tab. `errors` are lines of the console that tell of one, exceptions and failed loads;
    `requests` the addresses asked for, without the page's own file, data: and blob:.
    """

    def __init__(self, address: str):
        import websocket

        self.socket = websocket.create_connection(address, timeout=PATIENCE, suppress_origin=True)
        self.numbers = itertools.count(1)
        self.events: list[str] = []
        self.errors: list[str] = []
        self.requests: list[str] = []
        self.url = ""
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters) -> dict:
        """A command of the protocol and its result. Raises RuntimeError with the error of one that
        failed.
        """
        number = next(self.numbers)
        self.socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            told = json.loads(self.socket.recv())
            if told.get("id") == number:
                break
            self._notice(told)
        if "error" in told:
            raise RuntimeError(f"{method}: {told['error']['message']}")
        return told["result"]

    def _notice(self, event: dict):
        name, about = event["method"], event["params"]
        self.events.append(name)
        if name == "Runtime.exceptionThrown":
            thrown = about["exceptionDetails"]
            self.errors.append(thrown.get("exception", {}).get("description") or thrown["text"])
        elif name == "Runtime.consoleAPICalled" and about["type"] in ("error", "assert"):
            self.errors.append(" ".join(str(arg.get("value", "")) for arg in about["args"]))
        elif name == "Log.entryAdded" and about["entry"]["level"] == "error":
            self.errors.append(about["entry"]["text"])
        elif name == "Network.requestWillBeSent":
            url = about["request"]["url"]
            if url != self.url and not url.startswith(("data:", "blob:")):
                self.requests.append(url)

    def size(self, width: int, height: int = 900, ratio: float = 1.0):
        """The window [CSS pixels], a phone's below 600."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=ratio,
            mobile=width < 600,
        )

    def media(self, *, dark: bool = False, paper: bool = False, reduced: bool = False):
        """What CSS and scripts are told: a dark scheme, print, less motion."""
        features = {
            "prefers-color-scheme": "dark" if dark else "light",
            "prefers-reduced-motion": "reduce" if reduced else "no-preference",
        }
        self.call(
            "Emulation.setEmulatedMedia",
            media="print" if paper else "",
            features=[{"name": name, "value": value} for name, value in features.items()],
        )

    def go(self, path: Path):
        """Opens a file and waits until it has loaded."""
        self.url = path.resolve().as_uri()
        self.events.clear()
        self.call("Page.navigate", url=self.url)
        while "Page.loadEventFired" not in self.events:
            self._notice(json.loads(self.socket.recv()))

    def evaluate(self, expression: str):
        """The value of an expression of JavaScript; a promise is waited for. Raises RuntimeError
        with what it throws.
        """
        told = self.call(
            "Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True
        )
        if "exceptionDetails" in told:
            thrown = told["exceptionDetails"]
            raise RuntimeError(thrown.get("exception", {}).get("description") or thrown["text"])
        return told["result"].get("value")

    def wait(self, condition: str, seconds: float = PATIENCE):
        """Until an expression holds. Raises TimeoutError."""
        end = time.monotonic() + seconds
        while not self.evaluate(f"Boolean({condition})"):
            if time.monotonic() > end:
                raise TimeoutError(f"{condition} did not hold within {seconds:g} s: {self.errors}")
            time.sleep(0.05)

    def key(self, name: str):
        """Presses a key of KEYS where the focus is."""
        code, number = KEYS[name]
        about = {"key": name, "code": code, "windowsVirtualKeyCode": number}
        text = {"text": " "} if name == " " else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", **about, **text)
        self.call("Input.dispatchKeyEvent", type="keyUp", **about)

    def press(self, selector: str, across: float = 0.5):
        """The pointer pressed on an element, at a share of its width."""
        box = self.evaluate(
            f"(e => (e.scrollIntoView({{block: 'center'}}), e.getBoundingClientRect().toJSON()))"
            f"(document.querySelector({json.dumps(selector)}))"
        )
        place = {"x": box["x"] + across * box["width"], "y": box["y"] + 0.5 * box["height"]}
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, button="left", clickCount=1, **place)

    def screenshot(self, selector: str = "", path: Path | None = None) -> np.ndarray:
        """Pixels (height, width, 3), 0 to 1, of the window or of an element; kept at `path`."""
        clip = {}
        if selector:
            box = self.evaluate(
                f"(e => (r => [r.x + scrollX, r.y + scrollY, r.width, r.height])"
                f"(e.getBoundingClientRect()))(document.querySelector({json.dumps(selector)}))"
            )
            clip = {"clip": dict(zip(("x", "y", "width", "height"), box), scale=1)}
        told = self.call("Page.captureScreenshot", captureBeyondViewport=bool(selector), **clip)
        png = base64.b64decode(told["data"])
        if path:
            path.write_bytes(png)
        return imread(io.BytesIO(png))[:, :, :3]

    def pdf(self, path: Path | None = None) -> bytes:
        """The page on A4."""
        told = self.call(
            "Page.printToPDF", paperWidth=8.27, paperHeight=11.69, printBackground=False
        )
        data = base64.b64decode(told["data"])
        if path:
            path.write_bytes(data)
        return data

    def serious(self) -> list:
        """Serious and critical faults of accessibility, as axe-core finds them: [rule, impact,
        elements]. Skips the test where GRAINPAIR_AXE names no axe.min.js.
        """
        axe = os.environ.get("GRAINPAIR_AXE", "")
        if not axe:
            pytest.skip("GRAINPAIR_AXE names no axe.min.js (npm pack axe-core)")
        self.evaluate(Path(axe).read_text() + ";0")
        # without `preload`: that asks for the styles again, which file:// does not give
        found = self.evaluate(
            "axe.run({preload: false}).then(r => r.violations.map(v => "
            "[v.id, v.impact, v.nodes.map(n => n.html).join(' ')]))"
        )
        return [one for one in found if one[1] in ("serious", "critical")]

    def close(self):
        self.socket.close()


class Browser:
    """A chromium that listens at `port`. `open` gives a page of its own each time and closes the
    one before.
    """

    def __init__(self, port: int, process: int):
        self.port, self.process = port, process
        self.page: Page | None = None

    def cpu_seconds(self) -> float:
        """Processor time of all its processes so far."""
        stat = {}  # parent and ticks by process
        for entry in Path("/proc").glob("[0-9]*/stat"):
            try:
                words = entry.read_text().rpartition(")")[2].split()
            except OSError:  # it has ended meanwhile
                continue
            stat[int(entry.parent.name)] = int(words[1]), int(words[11]) + int(words[12])
        ours = {self.process}
        while more := {pid for pid, (parent, _) in stat.items() if parent in ours} - ours:
            ours |= more
        return sum(stat[pid][1] for pid in ours if pid in stat) / os.sysconf("SC_CLK_TCK")

    def open(self, path: Path, width: int = 1280, height: int = 900, ratio: float = 1.0, **media):
        """A page of a file, as wide as said; `media` as Page.media takes them."""
        page = self.blank()
        page.size(width, height, ratio)
        page.media(**media)
        page.go(path)
        return page

    def blank(self) -> Page:
        """An empty page, the only one."""
        made = json.loads(self._ask("new?about:blank", "PUT"))
        if self.page:
            self.page.close()
        self.page = Page(made["webSocketDebuggerUrl"])
        self.page.call("Page.bringToFront")
        for entry in json.loads(self._ask("list")):
            if entry["type"] == "page" and entry["id"] != made["id"]:
                try:
                    self._ask(f"close/{entry['id']}")
                except HTTPError:  # it was still listed, but is gone
                    pass
        return self.page

    def _ask(self, what: str, method: str = "GET") -> bytes:
        """The browser's own answer, which no page has to be open for. Raises OSError."""
        asked = Request(f"http://127.0.0.1:{self.port}/json/{what}", method=method)
        return urlopen(asked, timeout=PATIENCE).read()


@contextmanager
def started(*flags: str) -> Iterator[Browser]:
    """A chromium with more `flags`, ended afterwards."""
    if not shutil.which(CHROMIUM):
        pytest.skip(f"{CHROMIUM} is not installed (packages-check.txt)")
    pytest.importorskip("websocket", reason="python3-websocket is not installed")
    with temporary() as home:
        words = [CHROMIUM, *QUIET, *(flags or SOFTWARE), f"--user-data-dir={home}", "about:blank"]
        fonts = Path(findfont("DejaVu Sans")).parent
        (home / "fonts.conf").write_text(FONTS.format(fonts=fonts, cache=home / "fonts"))
        with open(home / "log", "w") as log:
            process = children.start(
                words,
                stdout=log,
                stderr=log,
                start_new_session=True,
                env=os.environ | {"FONTCONFIG_FILE": str(home / "fonts.conf")},
            )
        try:
            yield Browser(port_of(home, process), process.pid)
        finally:
            children.end(process, group=True)


def port_of(home: Path, process) -> int:
    """The port that a chromium chose, once it listens."""
    file, end = home / "DevToolsActivePort", time.monotonic() + PATIENCE
    while not (file.exists() and file.read_text().strip()):
        if process.poll() is not None or time.monotonic() > end:
            raise RuntimeError(f"chromium did not start: {(home / 'log').read_text()[-2000:]}")
        time.sleep(0.05)
    return int(file.read_text().split()[0])


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with started() as running:
        yield running
