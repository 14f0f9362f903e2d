"""Gates and walls other than the default's, on the smallest column.

Every wall force is checked against the engine's.
"""

import h5py
import numpy as np
import pytest

from cases.case import load
from dem_reference.run import main

CASE = "cases/column_ci"


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return tmp_path_factory.mktemp("packings")


def run(folder, store, *assignments):
    words = [word for assignment in assignments for word in ("--set", assignment)]
    path = folder / "dem.h5"
    assert main([CASE, "-o", str(path), "--packings", str(store), "--quiet", *words]) == 0
    return path


def wall_codes(path):
    """Codes of the walls touched, frame by frame."""
    with h5py.File(path) as file:
        steps = sorted(map(int, file["data"]))
        return [
            set(np.unique(file[f"data/{step}/contacts/second"][()])) & set(range(-9, 0))
            for step in steps
        ]


@pytest.fixture(scope="module")
def sudden(tmp_path_factory, store):
    return run(tmp_path_factory.mktemp("sudden"), store, "time.maximum=2.0")


@pytest.fixture(scope="module")
def lifted(tmp_path_factory, store):
    return run(
        tmp_path_factory.mktemp("lifted"),
        store,
        "time.maximum=2.0",
        "walls.gate=lifted",
        "walls.gate_speed=0.4",
    )


def peak(path):
    with h5py.File(path) as file:
        kinetic = file["energy/kinetic"][()]
        return file["energy/time"][kinetic.argmax()], kinetic.max()


def test_a_lifted_gate_holds_grains_back_until_it_is_gone(lifted):
    """It has passed the column's top and a diameter at 55 ms = 1.2 sqrt(H/g), in frame 6 of 0.2.

    (0.02 + 0.002) m / 0.4 m/s = 55 ms.
    """
    touched = [-2 in codes for codes in wall_codes(lifted)]
    assert touched[0] and touched[2]
    assert not any(touched[7:])


def test_a_lifted_gate_delays_and_lowers_the_peak(sudden, lifted):
    (early, high), (late, low) = peak(sudden), peak(lifted)
    assert late > early and low < high


@pytest.mark.parametrize("which", ["sudden", "lifted"])
def test_forces_of_the_gate_and_walls_are_the_engines(which, request):
    """1e-12 N against a grain's weight of 1e-4 N.

    The gate of triangles, its edge included, acts like the half-plane.
    """
    with h5py.File(request.getfixturevalue(which)) as file:
        assert file.attrs["force_error"] < 1e-12


@pytest.fixture(scope="module")
def walled(tmp_path_factory):
    """Smooth sides, Coulomb base and Coulomb left wall."""
    folder = tmp_path_factory.mktemp("walled")
    return run(
        folder,
        folder / "store",
        "walls.front_back=smooth",
        "walls.base=coulomb",
        "walls.base_friction=0.4",
        "walls.left=coulomb",
        "walls.left_friction=0.3",
        "time.maximum=2.0",
        "dem.void_ratio_tolerance=0.2",
        "dem.packing_friction=0.2",
        "geometry.floor_length=0.2",
    )


def test_grains_stay_between_smooth_sides(walled):
    case = load(CASE)
    with h5py.File(walled) as file:
        for step in file["data"]:
            z = file[f"data/{step}/particles/cloud/position/z"][()]
            slack = 0.05 * case["grains.diameter"]  # elastic overlap
            assert z.min() > case["grains.diameter"] / 2 - slack
            assert z.max() < case["geometry.thickness"] - case["grains.diameter"] / 2 + slack
    assert {-1, -3, -4, -5} <= set.union(*wall_codes(walled))


def test_a_coulomb_base_dissipates_and_obeys_its_friction(walled):
    with h5py.File(walled) as file:
        assert not (file["data/0/particles/cloud/kind"][()] == 3).any()
        assert file["energy/dissipated_wall"][-1] > 0.02 * file["energy/dissipated"][-1]
        found = []
        for step in list(file["data"])[1:]:
            contacts = file[f"data/{step}/contacts"]
            floor = contacts["second"][()] == -3
            f = {axis: contacts[f"force/{axis}"][()][floor] for axis in "xyz"}
            found.append(np.hypot(f["x"], f["z"]) / np.abs(f["y"]))
        ratios = np.concatenate(found)
    # damping acts on top of a sticking spring, which may carry a contact a little beyond the cone;
    # sliding ones lie on it
    on_cone = np.abs(ratios - 0.4) < 1e-5
    assert on_cone.mean() > 0.05
    assert (ratios > 0.4 + 1e-5).mean() < 0.02


def test_the_balance_closes_with_wall_friction_too(walled):
    """The tangential springs of walls are unknown.

    What they hold is within a few per cent of the energy released.
    """
    with h5py.File(walled) as file:
        energy = {name: values[()] for name, values in file["energy"].items()}
    released = energy["potential"][0] - energy["potential"][-1]
    assert abs(energy["unaccounted"][-1]) < 0.05 * released
