"""Text dumps of a block of grains on a glued floor whose motion is known: x → (1 + s) x,
y → y/(1 + s), s from 0 to 1, so the run-out is 0.9 L0 by the centres; y up, 2 mm, 2500 kg/m3.
"""

from pathlib import Path
from typing import Any

import numpy as np
from synthetic import CASE, block

from cases import case
from compare.importing.options import Options
from compare.importing.pipeline import convert

L, H, W, D, RHO = 0.02, 0.02, 0.006, 0.002, 2500.0  # m, kg/m3
SIZES = {"height": H, "length": L, "thickness": W, "floor_length": 1.0}
SCENE = case.parse(CASE.format(**SIZES, void_ratio=0.7))
STEPS = {0: 0.0, 2000: 0.4, 5000: 1.0}  # s of each
DT = 1e-5
COLUMNS = "id type x y z vx vy vz radius"
BOX = ("mm mm pp", [(-0.002, 0.3), (-0.01, 0.1), (0.0, W)])


def grains(s: float) -> dict[str, np.ndarray]:
    """Columns of the frame at s: 300 grains that move on 60 glued ones of type 3."""
    moving = block(H, L, W, D)
    floor = block(D, 2 * L, W, D) - [0.0, D, 0.0]
    rate = 1.0 / (max(STEPS) * DT)
    x = np.concatenate([moving * [1 + s, 1 / (1 + s), 1], floor])
    v = np.concatenate([moving * [rate, -rate / (1 + s) ** 2, 0], 0 * floor])
    n = len(x)
    return {
        "id": np.arange(1, n + 1),
        "type": np.where(np.arange(n) < len(moving), 1, 3),
        **dict(zip(("x", "y", "z"), x.T)),
        **dict(zip(("vx", "vy", "vz"), v.T)),
        "radius": np.full(n, D / 2),
    }


def text(step: int, columns: dict, names: str = COLUMNS, head: str = "", box=BOX) -> str:
    """One frame, its rows in an order of chance."""
    rows = np.stack([np.asarray(columns[name]) for name in names.split()], axis=1)
    rows = np.random.default_rng(step).permutation(rows)
    flags, corners = box
    bounds = "".join(f"{low} {high}\n" for low, high in corners)
    lines = "".join(" ".join(f"{one:.17g}" for one in row) + "\n" for row in rows)
    return (
        f"{head}ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{len(rows)}\n"
        f"ITEM: BOX BOUNDS {flags}\n{bounds}ITEM: ATOMS {names} \n{lines}"
    )


def write(path: Path, change=lambda step, columns: columns, steps=STEPS, **more) -> Path:
    """A dump of several frames, each changed by change(step, columns)."""
    frames = [text(step, change(step, grains(STEPS[step])), **more) for step in steps]
    path.write_text("".join(frames))
    return path


def imported(folder: Path, *files: Path, scene=SCENE, **more) -> tuple[Path, list[str]]:
    """The file of grains that the pipeline makes, and its notes."""
    path = folder / "grains.h5"
    told: dict[str, Any] = {"time_step": DT} | more
    options = Options(files, **told)
    return path, convert(options, scene, path)
