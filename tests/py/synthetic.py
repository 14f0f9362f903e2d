"""Small run files of both engines, made from formulas, so that what the comparison says of them is
known.

The cloud is a block of points that spreads: x = x0 s(t), with s(t) growing from 1 to `stretch`
along a smooth step, so that every point has a known place and velocity at any time. The energy
history is a formula too. Nothing here is an engine; the files only follow the layout of
CONTRIBUTING.md.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cases import openpmd

CASE = """
title = "Synthetic block"
[geometry]
dimension = "plane_strain"
height = {height}
length = {length}
thickness = {thickness}
floor_length = {floor_length}
gravity = 9.81
[grains]
diameter = 0.002
density = 2500.0
[initial]
void_ratio = {void_ratio}
[mpm]
cell_size = 0.002
[walls]
front_back = "periodic"
[compare]
kernel = "gauss"
width = 0.75
spacing = 1.0
margin_run_out = 0.05
margin_height = 0.05
margin_time = 0.05
margin_energy = 0.05
margin_distance = 0.03
"""

DENSITY = 2500.0  # kg/m3
DIAMETER = 0.002  # m


def block(height, length, thickness, spacing, rng=None):
    """Positions (N, 3) of a lattice that fills height x length x thickness, jittered by a tenth
    when rng is given.
    """
    counts = [max(1, round(extent / spacing)) for extent in (length, height, thickness)]
    axes = [
        (np.arange(n) + 0.5) * extent / n for n, extent in zip(counts, (length, height, thickness))
    ]
    x = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    if rng is not None:
        x = x + rng.uniform(-0.1, 0.1, x.shape) * spacing
    return x


def smooth_step(s):
    s = np.clip(s, 0.0, 1.0)
    return s * s * (3.0 - 2.0 * s)


@dataclass(frozen=True)
class Motion:
    """A block of points (N, 3) that is stretched in x by `stretch` over `duration` time scales of
    `scale` seconds, its height shrinking in proportion; times tau in time scales.
    """

    x0: np.ndarray
    stretch: float
    duration: float
    scale: float

    def stretch_at(self, tau):
        return 1.0 + (self.stretch - 1.0) * smooth_step(tau / (0.8 * self.duration))

    def place(self, tau):
        """Positions [m] and velocities [m/s]."""
        s, eps = self.stretch_at(tau), 1e-6
        rate = (self.stretch_at(tau + eps) - self.stretch_at(tau - eps)) / (2.0 * eps * self.scale)
        return self.x0 * [s, 1.0 / s, 1.0], self.x0 * [rate, -rate / s**2, 0.0]


def write_run(
    path,
    engine,
    *,
    height=0.04,
    length=0.04,
    thickness=0.008,
    void_ratio=0.7,
    stretch=2.0,
    duration=5.0,
    frames=26,
    dissipated=0.97,
    peak=0.05,
    peak_time=1.2,
    seed=1,
    jitter=True,
    spacing=0.002,
    floor_length=1.0,
    attributes=None,
):
    """Writes a run of `engine` ("mpm" or "dem") whose block moves as Motion says.

    The potential energy follows the points; the kinetic energy is a bump of height `peak` (of M g
    H) at `peak_time` time scales; `dissipated` is the share of the remaining loss booked as
    physical, the rest is unaccounted; `attributes` go onto the file's own. Returns the path.
    """
    rng = np.random.default_rng(seed)
    x0 = block(height, length, thickness, spacing, rng if jitter else None)
    motion = Motion(x0, stretch, duration, np.sqrt(height / 9.81))
    solid = height * length * thickness / (1.0 + void_ratio)
    mass = np.full(len(x0), solid * DENSITY / len(x0))
    scene = {"height": height, "length": length, "thickness": thickness}
    case = CASE.format(**scene, void_ratio=void_ratio, floor_length=floor_length)

    path = Path(path)
    with openpmd.create(path, engine, _attributes(engine, case, seed, motion.scale)) as f:
        openpmd.describe(f, attributes)
        for i, tau in enumerate(np.linspace(0.0, duration, frames)):
            step = openpmd.frame(f, i * 100, tau * motion.scale, 1e-5)
            cloud = step.create_group("particles/cloud")
            x, v = motion.place(tau)
            _write_cloud(cloud, engine, x, v, mass, void_ratio)

        tau = np.linspace(0.0, duration, 501)
        potential = 9.81 * (mass * x0[:, 1]).sum() / motion.stretch_at(tau)
        bump = np.exp(-(((tau - peak_time) / 0.5) ** 2))
        kinetic = peak * mass.sum() * 9.81 * height * bump
        kinetic[0] = 0.0
        held = {"time": tau * motion.scale, "kinetic": kinetic, "potential": potential}
        loss = potential[0] - potential - kinetic
        rows = held | _accounts(engine, loss, dissipated)
        openpmd.history(
            f, {name: (row, "s" if name == "time" else "J", name) for name, row in rows.items()}
        )
    return path


def _attributes(engine, case, seed, scale) -> dict:
    return {
        "date": "2026-01-01 00:00:00 +0000",
        "machine": "formula",
        "engine_version": "synthetic",
        "commit": "none",
        "seed": seed,
        "case": case,
        "case_resolved": case,
        "command": "synthetic",
        "threads": 1,
        "cpu_seconds": 1.5 if engine == "mpm" else 30.0,
        "cpu_seconds_engine": 1.2 if engine == "mpm" else 24.0,
        "wall_seconds": 2.0,
        "time_scale": scale,
        "end_reason": "rest",
    }


def _write_cloud(cloud, engine, x, v, mass, void_ratio):
    count = len(mass)

    def write(name, values, unit, kind=np.float64):
        openpmd.record(cloud, name, values, unit, kind)

    write("position", x, "m")
    openpmd.offset(cloud, count)
    write("velocity", v, "m/s")
    write("id", np.arange(1, count + 1), "-", np.uint64)
    write("mass", mass, "kg")
    write("solid_volume", mass / DENSITY, "m3")
    if engine == "dem":
        write("radius", np.full(count, DIAMETER / 2), "m")
        write("kind", np.ones(count), "-", np.uint8)
        write("angular_velocity", np.zeros_like(x), "1/s")
        return
    write("void_ratio", np.full(count, void_ratio), "-")
    write("granular_temperature", np.full(count, 1e-4), "m2/s2")
    depth = np.maximum(x[:, 1].max() - x[:, 1], 0.0)
    weight = DENSITY / (1.0 + void_ratio) * 9.81 * depth
    write("stress", np.outer(weight, [0.5, 1.0, 0.5, 0.0, 0.0, 0.0]), "Pa")


def _accounts(engine, loss, dissipated) -> dict:
    """What has become of the energy lost: the share `dissipated` of it, and the rest."""
    gone, rest, none = dissipated * loss, (1 - dissipated) * loss, np.zeros_like(loss)
    both = {"rotational": none, "elastic": none, "dissipated": gone, "unaccounted": rest}
    if engine == "mpm":
        return both | {
            "fluctuation": none,
            "dissipated_plastic": 0.6 * gone,
            "dissipated_regime_4": 0.4 * gone,
            "dissipated_wall": none,
            "loss_transfer": 0.7 * rest,
            "loss_time_integration": 0.3 * rest,
            "loss_mixing": none,
            "loss_detached": none,
            "loss_conduction": none,
        }
    return both | {
        "dissipated_normal": 0.2 * gone,
        "dissipated_tangential": 0.8 * gone,
        "dissipated_wall": none,
        "dissipated_short": 0.55 * gone,
        "dissipated_enduring": 0.45 * gone,
    }


def write_pair(folder, mpm=None, dem=None):
    """mpm.h5 and dem.h5 in `folder`; keywords of write_run for either side."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    write_run(
        folder / "mpm.h5", "mpm", **({"seed": 1, "jitter": False, "spacing": 0.00125} | (mpm or {}))
    )
    write_run(folder / "dem.h5", "dem", **({"seed": 2} | (dem or {})))
    return folder
