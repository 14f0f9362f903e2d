"""Pictures of whole pages, small enough to be kept, and how two of them are compared.

A page is shown as a desk, a phone, a dark screen and paper show it.
"""

import base64
import io
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from browser import Page
from matplotlib.image import imread
from PIL import Image

VIEWS = {
    "1280": {"width": 1280},
    "390": {"width": 390},
    "dark": {"width": 1280},
    "print": {"width": 1280},
}
# Pixels of a kept picture to a CSS pixel, and to the inch of paper.
SCALE = {"1280": 0.25, "dark": 0.2, "390": 0.35}
PAPER = 32
TILE = 4000  # CSS pixels in one screenshot: longer ones pass what a graphics card holds
# Of a kept picture: rare colours, such as a link's, are not given up for more greys.
COLOURS, METHOD, ROUNDS = 32, Image.Quantize.MAXCOVERAGE, 2

# Blocks of 8 x 8 kept pixels, about a line of text high and a word long, by their mean colours, 0
# to 1. Measured on all pages and views: the few colours of a kept picture alone put 0.06 % of a
# page's blocks more than 0.05 apart, a chromium without hinting and subpixels
# (--font-render-hinting=none --disable-lcd-text) 0.2 %; the least of the faults in test_faces.py
# puts 2 % of them there. SHARE lies between the two, by a factor of three or four from each.
BLOCK, REACH = 8, 3
APART, SHARE = 0.05, 0.007
LONGER = 0.02  # of a page's length: a line in fifty that wraps elsewhere


def show(tab: Page, view: str):
    """Puts a page into a view."""
    tab.size(VIEWS[view]["width"])
    tab.media(dark=view == "dark")
    tab.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")


def look(tab: Page, view: str) -> np.ndarray:
    """A picture (height, width, 3), 0 to 255, of all of a page in a view."""
    show(tab, view)
    return paper(tab.pdf()) if view == "print" else screen(tab, SCALE[view])


def screen(tab: Page, scale: float) -> np.ndarray:
    """All of a page, twice as fine at first, so that thin lines are not lost."""
    height = tab.evaluate("document.documentElement.scrollHeight")
    width = tab.evaluate("innerWidth")
    tiles = []
    for y in range(0, height, TILE):
        clip = {"x": 0, "y": y, "width": width, "height": min(TILE, height - y)}
        told = tab.call(
            "Page.captureScreenshot", captureBeyondViewport=True, clip=clip | {"scale": 2 * scale}
        )
        tiles.append(imread(io.BytesIO(base64.b64decode(told["data"])))[:, :, :3])
    fine = np.concatenate(tiles)
    fine = fine[: len(fine) // 2 * 2, : fine.shape[1] // 2 * 2]
    pooled = fine.reshape(len(fine) // 2, 2, fine.shape[1] // 2, 2, 3).mean(axis=(1, 3))
    return np.round(255.0 * pooled).astype(np.uint8)


def paper(pdf: bytes) -> np.ndarray:
    """The sheets of a PDF beside each other, with a dark line between them."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "page.pdf").write_bytes(pdf)
        words = ["pdftoppm", "-r", str(PAPER), "-png", "page.pdf", "sheet"]
        subprocess.run(words, cwd=folder, check=True)
        sheets = [imread(file)[:, :, :3] for file in sorted(Path(folder).glob("sheet*.png"))]
    height = max(map(len, sheets))
    shown = []
    for sheet in sheets:
        shown.append(np.pad(sheet, ((0, height - len(sheet)), (0, 0), (0, 0))))
        shown.append(np.zeros((height, 2, 3)))
    return np.round(255.0 * np.concatenate(shown, axis=1)).astype(np.uint8)


def can_print() -> bool:
    return shutil.which("pdftoppm") is not None


def keep(picture: np.ndarray, path: Path):
    """Writes a picture in few colours, which is what makes it small."""
    path.parent.mkdir(parents=True, exist_ok=True)
    image = Image.fromarray(picture).quantize(COLOURS, METHOD, ROUNDS, dither=Image.Dither.NONE)
    image.save(path, optimize=True)


def kept(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path).convert("RGB"))


def blocks(picture: np.ndarray, shift: int = 0) -> np.ndarray:
    """Mean colours of the blocks of a picture that is moved down by `shift`."""
    moved = np.roll(picture, shift, axis=0)
    rows, columns = (size // BLOCK for size in picture.shape[:2])
    cut = moved[: rows * BLOCK, : columns * BLOCK] / 255.0
    return cut.reshape(rows, BLOCK, columns, BLOCK, 3).mean(axis=(1, 3))


def apart(new: np.ndarray, old: np.ndarray) -> np.ndarray:
    """How far the blocks of two pictures of one width are apart, 0 to 1, each where it fits best
    up to REACH pixels higher or lower.
    """
    height = min(len(new), len(old))
    new, old = new[:height], old[:height]
    here = blocks(new)
    off = [abs(here - blocks(old, k)).max(axis=-1) for k in range(-REACH, REACH + 1)]
    return np.min(off, axis=0)


def difference(new: np.ndarray, old: np.ndarray) -> str:
    """What tells two pictures of a page apart; "" where nothing does."""
    if new.shape[1] != old.shape[1]:
        return f"{new.shape[1]} pixels wide in place of {old.shape[1]}"
    if abs(len(new) - len(old)) > max(LONGER * len(old), 2 * REACH):
        return f"{len(new)} pixels long in place of {len(old)}"
    share = float(np.mean(apart(new, old) > APART))
    return f"{share:.1%} of the page differs" if share > SHARE else ""
