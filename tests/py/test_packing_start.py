"""initial.state = packing: the continuum starts from the settled grains' mass, void ratio and
stress.
"""

import subprocess

import h5py
import numpy as np
import pytest

from cases.programs import program

THICKNESS, SIDE, CELLS = 0.006, 0.02, 4  # of column_ci
DENSITY = 2532.0  # of the case


@pytest.fixture
def packing(tmp_path):
    """A made-up packing on the cells of column_ci: void ratio and stress that differ from cell to
    cell.
    """
    rng = np.random.default_rng(5)
    faces = np.linspace(0.0, SIDE, CELLS + 1)
    void_ratio = rng.uniform(0.65, 0.8, (CELLS, CELLS))
    y = 0.5 * (faces[1:] + faces[:-1])
    stress = {"xx": 0.6, "yy": 1.0, "zz": 0.7, "xy": 0.05, "yz": 0.0, "zx": 0.0}
    path = tmp_path / "dem.h5"
    with h5py.File(path, "w") as f:
        group = f.create_group("packing")
        group["profile_x"] = group["profile_y"] = faces
        group["profile_void_ratio"] = void_ratio
        group["profile_mass"] = DENSITY / (1 + void_ratio) * (SIDE / CELLS) ** 2 * THICKNESS
        for name, share in stress.items():
            group[f"profile_stress_{name}"] = np.tile(share * 1400 * 9.81 * (SIDE - y), (CELLS, 1))
    return path, void_ratio


def mpm_run(tmp_path, *words):
    out = tmp_path / "mpm.h5"
    done = subprocess.run(
        [
            str(word)
            for word in (
                program("mpm_run"),
                "cases/column_ci",
                "-o",
                out,
                "--set",
                "time.maximum=0.01",
                "--set",
                "material.law=linear_elastic",  # stress of points, not of cells:
                "--set",
                "mpm.volumetric_averaging=none",
                *words,
            )
        ],
        capture_output=True,
        text=True,
    )
    return done, out


def start(path):
    with h5py.File(path) as f:
        cloud = f["data/0/particles/cloud"]
        return {
            "x": cloud["position/x"][:],
            "y": cloud["position/y"][:],
            "mass": cloud["mass"][:],
            "e": cloud["void_ratio"][:],
            **{c: cloud[f"stress/{c}"][:] for c in ("xx", "yy", "xy")},
        }


def test_points_take_mass_void_ratio_and_stress(tmp_path, packing):
    path, void_ratio = packing
    done, out = mpm_run(tmp_path, "--set", "initial.state=packing", "--packing", path)
    assert done.returncode == 0, done.stderr
    points = start(out)
    with h5py.File(path) as f:
        assert points["mass"].sum() == pytest.approx(f["packing/profile_mass"][:].sum(), rel=1e-14)
    i, j = ((points[c] / (SIDE / CELLS)).astype(int) for c in "xy")
    np.testing.assert_allclose(
        points["e"], void_ratio[i, j], rtol=1e-6
    )  # stored in single precision
    # linear between the centres of the cells, constant beyond: exact for a linear profile inside
    inside = (points["y"] > 0.5 * SIDE / CELLS) & (points["y"] < SIDE - 0.5 * SIDE / CELLS)
    expected = 1400 * 9.81 * (SIDE - points["y"][inside])
    for name, share in (("xx", 0.6), ("yy", 1.0), ("xy", 0.05)):
        np.testing.assert_allclose(points[name][inside], share * expected, rtol=1e-5)


def test_nominal_start_differs(tmp_path, packing):
    done, out = mpm_run(tmp_path)
    assert done.returncode == 0, done.stderr
    np.testing.assert_allclose(
        start(out)["e"], 0.71, rtol=1e-6
    )  # the negative control: the case's void ratio everywhere


@pytest.mark.parametrize(
    "words, line",
    [
        (["--set", "initial.state=packing"], "initial.state: no packing"),
        (["--packing", "PACKING"], "initial.state is nominal"),
        (
            ["--set", "initial.state=packing", "--packing", "README.md"],
            "README.md: no settled packing",
        ),
        (
            [
                "--set",
                "initial.state=packing",
                "--packing",
                "PACKING",
                "--set",
                "geometry.dimension=axisymmetric",
            ],
            "axisymmetric",
        ),
        (
            [
                "--set",
                "initial.state=packing",
                "--packing",
                "PACKING",
                "--set",
                "geometry.height=0.03",
            ],
            "geometry.height = 0.03 (the packing",
        ),
        (
            [
                "--set",
                "initial.state=packing",
                "--packing",
                "PACKING",
                "--set",
                "geometry.thickness=0.01",
            ],
            "geometry.thickness = 0.01 (the packing",
        ),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path, packing, words, line):
    done, out = mpm_run(tmp_path, *(packing[0] if word == "PACKING" else word for word in words))
    assert done.returncode == 2 and not out.exists()
    assert line in done.stderr and done.stderr.count("\n") == 1
