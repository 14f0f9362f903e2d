"""A quarter of a cylinder of grains: packing, release, and what is measured about its axis."""

import h5py
import numpy as np
import pytest

from dem_reference.edge import edge
from dem_reference.run import main
from dem_reference.void_ratio import quarter_bulk_box, void_ratio

SMALL = [
    "--set",
    "geometry.height=0.016",
    "--set",
    "geometry.length=0.02",
    "--set",
    "geometry.floor_length=0.05",
    "--set",
    "dem.young_modulus=5e6",
    "--set",
    "time.maximum=1.2",
    "--quiet",
]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cylinder")
    assert (
        main(
            [
                "cases/cylinder",
                "-o",
                str(folder / "dem.h5"),
                "--packings",
                str(folder / "packings"),
                *SMALL,
            ]
        )
        == 0
    )
    return folder / "dem.h5"


def test_the_grains_fill_a_quarter_and_leave_it_all_around(run):
    with h5py.File(run) as file:
        first, last = (file[f"data/{step}/particles/cloud"] for step in (0, file.attrs["steps"]))
        grains = first["kind"][()] == 1
        inside, outside = (
            {axis: cloud[f"position/{axis}"][()][grains] for axis in "xz"}
            for cloud in (first, last)
        )
        found = file["packing"].attrs["void_ratio_overall"]
    d = 0.002
    for place in (
        inside,
        outside,
    ):  # smooth walls hold the quarter; soft grains dent them by less than a twentieth
        assert min(place["x"].min(), place["z"].min()) > 0.45 * d
    assert np.hypot(inside["x"], inside["z"]).max() < 0.02 - 0.45 * d
    assert found == pytest.approx(
        0.71, abs=0.15
    )  # walls keep a layer of grains apart; overall, not in the bulk
    r, theta = np.hypot(outside["x"], outside["z"]), np.arctan2(outside["z"], outside["x"])
    assert r.max() > 0.025
    # mass goes alike to either side of the diagonal: within four standard deviations of a fair coin
    flown = theta[r > 0.02]
    assert abs((flown > np.pi / 4).sum() - flown.size / 2) < 4 * np.sqrt(flown.size) / 2


def test_its_energies_close(run):
    with h5py.File(run) as file:
        energy = {name: values[()] for name, values in file["energy"].items()}
    released = energy["potential"][0] - energy["potential"][-1]
    assert np.abs(energy["unaccounted"]).max() < 0.05 * released  # sampled every 40 steps
    assert (energy["fluctuation"] <= energy["kinetic"] + 1e-12).all()


@pytest.mark.parametrize(
    "key, word", [("walls.left=coulomb", "walls.left"), ("geometry.length=0.01", "geometry.length")]
)
def test_what_a_cylinder_cannot_have_is_refused(key, word, tmp_path, capsys):
    words = ["--set", "walls.left_friction=0.3"] if "left" in key else []
    assert (
        main(["cases/cylinder", "-o", str(tmp_path / "dem.h5"), "--set", key, *words, "--quiet"])
        == 2
    )
    assert word in capsys.readouterr().err


def test_edge_of_a_known_disc():
    """A square lattice covers sqrt(3)/2 of a close-packed layer out to its rim.

    A lone grain further out is not the deposit.
    """
    x, z = np.meshgrid(np.arange(0.5, 40), np.arange(0.5, 40))
    r = np.hypot(x, z).ravel()
    assert edge(np.append(r[r < 20], 35.0), 1.0) == pytest.approx(20.0, abs=1.0)
    assert edge(np.append(x[:, :20].ravel(), 35.0), 1.0, width=40.0) == pytest.approx(20.0)


def test_void_ratio_of_a_lattice_in_a_box_of_three_limits():
    """Simple cubic, spacing one diameter, faces through contact planes: e = 6/pi - 1.

    No face cuts a sphere.
    """
    n = np.arange(0.5, 12)
    centre = np.stack(np.meshgrid(n, n, n), axis=-1).reshape(-1, 3)
    assert void_ratio(centre, 0.5, np.full(3, 2.0), np.full(3, 9.0), np.nan) == pytest.approx(
        6 / np.pi - 1, rel=1e-12
    )
    lower, upper = quarter_bulk_box(12.0, 10.0, 1.0)
    assert (
        np.hypot(upper[0], upper[2]) <= 12.0 - 2.5 + 1e-12
        and lower.min() == 2.5
        and upper[1] == 7.5
    )
