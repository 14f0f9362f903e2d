"""Grains of other people's runs: plain text dumps read back, refused where they are broken,
compared like any other.
"""

import h5py
import numpy as np
import pytest
from synthetic import CASE, block, write_run

from cases import case
from compare.mapping.runs import map_fields
from compare.verdict import comparison
from compare.mapping import dumps
from cases.errors import CaseError

SIZES = {"height": 0.04, "length": 0.04, "thickness": 0.008, "floor_length": 1.0}
SCENE = case.parse(CASE.format(**SIZES, void_ratio=0.7))
DT = 1e-5


def write_dump(
    path, steps, columns="id type x y z radius vx vy vz omegax omegay omegaz", shuffle=True
):
    """A falling block over one row of glued grains, in LIGGGHTS' own order of lines."""
    random = np.random.default_rng(1)
    x0 = block(0.04, 0.04, 0.008, 0.002)
    floor = block(0.002, 0.04, 0.008, 0.002) - [0.0, 0.002, 0.0]
    with open(path, "w") as f:
        for step in steps:
            t = step * DT
            rows = []
            for i, (x, moving) in enumerate(
                [(p, True) for p in x0] + [(p, False) for p in floor], start=1
            ):
                v = np.array([0.3, -9.81 * t, 0.0]) * moving
                y = x + np.array([0.3 * t, -0.5 * 9.81 * t**2, 0.0]) * moving
                values = {
                    "id": i,
                    "type": 1 if moving else 3,
                    "x": y[0],
                    "y": y[1],
                    "z": y[2],
                    "radius": 0.001,
                    "diameter": 0.002,
                    "vx": v[0],
                    "vy": v[1],
                    "vz": v[2],
                    "omegax": 0.0,
                    "omegay": 0.0,
                    "omegaz": 5.0 * moving,
                }
                rows.append(" ".join(f"{values[c]:.17g}" for c in columns.split()))
            if shuffle:
                random.shuffle(rows)
            f.write(
                f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{len(rows)}\nITEM: BOX BOUNDS mm "
                "mm pp\n"
                "-0.002 0.3\n-0.01 0.1\n0 0.008\n"
                f"ITEM: ATOMS {columns} \n" + "\n".join(rows) + "\n"
            )
    return path


def test_a_dump_becomes_a_run(tmp_path):
    late, early = write_dump(tmp_path / "b.dump", [2000]), write_dump(
        tmp_path / "a.dump", [0, 1000]
    )
    dumps.convert([late, early], SCENE, DT, tmp_path / "dem.h5")
    with h5py.File(tmp_path / "dem.h5") as f:
        assert sorted(f["data"], key=int) == ["0", "1000", "2000"]
        cloud = f["data/2000/particles/cloud"]
        assert f["data/2000"].attrs["time"] == pytest.approx(0.02)
        assert np.all(np.diff(cloud["id"][:]) > 0)
        moving = cloud["kind"][:] == 1
        assert moving.sum() == 20 * 20 * 4 and (~moving).sum() == 20 * 4
        mass = 2500.0 * 4 / 3 * np.pi * 1e-9 * moving.sum()
        energy = {k: v[:] for k, v in f["energy"].items()}
    v = 9.81 * energy["time"]
    assert energy["kinetic"] == pytest.approx(0.5 * mass * (0.09 + v**2))
    assert energy["rotational"] == pytest.approx(0.2 * mass * 1e-6 * 25.0 * np.ones(3))
    # A ballistic block keeps its energy.
    assert energy["dissipated"] == pytest.approx(np.zeros(3), abs=1e-12 * energy["potential"][0])


def test_a_dump_can_be_compared(tmp_path):
    dumps.convert([write_dump(tmp_path / "a.dump", [0, 5000])], SCENE, DT, tmp_path / "dem.h5")
    write_run(tmp_path / "mpm.h5", "mpm", frames=2)
    map_fields([tmp_path / "mpm.h5", tmp_path / "dem.h5"], tmp_path / "fields.h5")
    metrics = comparison.evaluate(comparison.load(tmp_path))
    assert metrics["mass"]["mpm"] == pytest.approx(metrics["mass"]["dem"], rel=1e-12)
    # 5000 steps at 0.3 m/s: 0.015 m on from 0.995 of a lattice of 2 mm in 0.04 m
    assert metrics["run_out"]["dem"] == pytest.approx((0.039 + 0.015) / 0.04 - 1.0, abs=1e-9)
    assert metrics["cpu_seconds_engine"]["dem"] is None


def test_diameters_do_as_well_as_radii(tmp_path):
    (snapshot,) = dumps.snapshots(
        write_dump(tmp_path / "a.dump", [0], "id x y z vx vy vz diameter")
    )
    assert np.all(snapshot.columns["radius"] == 0.001)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda text: "hello\n" + text, "a.dump:1: expected 'ITEM: TIMESTEP'"),
        (lambda text: text.replace(" vx", " ux"), "no column vx"),
        (lambda text: text[: len(text) // 2], "cut short"),
        (lambda text: "", "no snapshot"),
    ],
)
def test_broken_dumps_are_refused(tmp_path, spoil, message):
    path = write_dump(tmp_path / "a.dump", [0])
    path.write_text(spoil(path.read_text()))
    with pytest.raises(CaseError, match=message):
        dumps.convert([path], SCENE, DT, tmp_path / "dem.h5")
    assert not (tmp_path / "dem.h5").exists()
