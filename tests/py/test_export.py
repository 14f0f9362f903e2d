"""Frames for ParaView hold what the run file holds."""

import os
import runpy
import shutil
import subprocess
import sys
from unittest.mock import MagicMock
from xml.etree import ElementTree

import h5py
import meshio
import numpy as np
import pytest

from compare.mapping.runs import map_fields
from compare.report import paraview, vtk
from cases import openpmd
from cases.errors import CaseError
import synthetic


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "mpm.h5"
    synthetic.write_run(path, "mpm")
    return path


def test_every_frame_and_its_time_is_listed(run, tmp_path):
    listed = (
        ElementTree.parse(vtk.export(run, tmp_path).particles)
        .getroot()
        .findall("Collection/DataSet")
    )
    with h5py.File(run) as file:
        times = sorted(frame.attrs["time"] for frame in file["data"].values())
    assert [float(entry.attrib["timestep"]) for entry in listed] == times
    assert all((tmp_path / entry.attrib["file"]).exists() for entry in listed)


def test_points_and_records_come_back_unchanged(run, tmp_path):
    vtk.export(run, tmp_path)
    with h5py.File(run) as file:
        step = max(file["data"], key=int)
        cloud = file[f"data/{step}/particles/cloud"]
        back = meshio.read(tmp_path / run.stem / f"{step}.vtu")
        for d, axis in enumerate("xyz"):
            assert np.array_equal(back.points[:, d], cloud["position"][axis][()])
            assert np.array_equal(back.point_data["velocity"][:, d], cloud["velocity"][axis][()])
        assert np.array_equal(back.point_data["mass"], cloud["mass"][()])


def test_another_file_is_refused_and_leaves_nothing(tmp_path):
    other = tmp_path / "notes.h5"
    other.write_text("no run")
    with pytest.raises(CaseError, match="not HDF5, or cut short"):
        vtk.export(other, tmp_path / "out")
    assert not list((tmp_path / "out").iterdir())


THICKNESS = 0.008  # of the synthetic block, along which it repeats [m]
# First, second, branch, force of contacts: inside, across the periodic face, at the floor.
TOUCHING = [
    (1, 2, (0.0, -0.0019, 0.0), (0.0, -3.0, 0.0)),
    (1, 4, (0.0, 0.0, 0.0019), (0.0, 0.0, 4.0)),
    (3, -3, (0.0, 0.001, 0.0), (3.0, 4.0, 0.0)),
]


@pytest.fixture
def grains(tmp_path):
    """Three frames of grains, with contacts in the first two; there are none in the second."""
    path = synthetic.write_run(tmp_path / "dem.h5", "dem", frames=3)
    with h5py.File(path, "r+") as file:
        for step, count in ((0, len(TOUCHING)), (100, 0)):
            group = file.create_group(f"data/{step}/contacts")
            first, second, branch, force = (np.array(c) for c in zip(*TOUCHING))
            openpmd.record(group, "first", first[:count], "-", np.int32)
            openpmd.record(group, "second", second[:count], "-", np.int32)
            openpmd.record(group, "branch", branch[:count], "m", np.float64)
            openpmd.record(group, "force", force[:count], "N", np.float64)
            openpmd.record(group, "dissipation", np.ones(count), "W", np.float64)
    return path


def test_contacts_are_lines_that_end_at_the_nearest_image_and_at_walls(grains, tmp_path):
    made = vtk.export(grains, tmp_path / "vtk")
    assert made.contacts and made.contacts.name == "dem_contacts.pvd"
    listed = ElementTree.parse(made.contacts).getroot().findall("Collection/DataSet")
    assert len(listed) == 2  # the last frame has none
    drawn = meshio.read(tmp_path / "vtk" / "dem_contacts" / "0.vtu")
    lines = drawn.cells_dict["line"]
    start, end = drawn.points[lines[:, 0]], drawn.points[lines[:, 1]]
    with h5py.File(grains) as file:
        cloud = file["data/0/particles/cloud"]
        centre = dict(zip(cloud["id"], np.column_stack([cloud[f"position/{k}"] for k in "xyz"])))
    for k, (first, _, branch, force) in enumerate(TOUCHING):
        assert start[k] == pytest.approx(centre[first])
        assert end[k] == pytest.approx(centre[first] - branch)
        assert drawn.cell_data["force"][0][k] == pytest.approx(force)
    assert np.all(np.linalg.norm(end - start, axis=1) < 0.25 * THICKNESS)  # none crosses the slab
    assert drawn.cell_data["force_magnitude"][0].tolist() == [3.0, 4.0, 5.0]
    assert drawn.cell_data["dissipation"][0].tolist() == [1.0, 1.0, 1.0]
    assert drawn.cell_data["second"][0].tolist() == [2, 4, -3]
    assert made.seen.force == 5.0


def test_a_contact_of_nobody_is_refused(grains, tmp_path):
    with h5py.File(grains, "r+") as file:
        file["data/0/contacts/first"][1] = 10**6
    with pytest.raises(CaseError, match="of grains that are not in their frame"):
        vtk.export(grains, tmp_path / "vtk")
    assert not list((tmp_path / "vtk").iterdir())


def test_particles_have_the_fields_that_are_mapped(tmp_path):
    grains = synthetic.write_run(tmp_path / "dem.h5", "dem", frames=3)
    map_fields([grains], tmp_path / "fields.h5")
    made = vtk.export(grains, tmp_path / "vtk")
    points = meshio.read(tmp_path / "vtk" / "dem" / "0.vtu")
    with h5py.File(tmp_path / "fields.h5") as file:
        x, y = file["grid/x"][:], file["grid/y"][:]
        field = file["dem/void_ratio"][0]
    place = points.points[7]
    nearest = field[np.argmin(abs(y - place[1])), np.argmin(abs(x - place[0]))]
    assert points.point_data["mapped_void_ratio"][7] == pytest.approx(nearest, rel=1e-6)
    assert "mapped_void_ratio" in made.seen.ranges


@pytest.fixture
def exported(grains, tmp_path):
    """A pair, exported with its script."""
    mpm = synthetic.write_run(tmp_path / "mpm.h5", "mpm", frames=2, stretch=3.0)
    made = [vtk.export(path, tmp_path / "vtk") for path in (grains, mpm)]
    return paraview.write(made, ["dem", "mpm"], tmp_path / "vtk", tmp_path / "vtk"), made


def test_the_script_opens_both_sides_in_the_same_colours(exported, monkeypatch):
    """Against a ParaView that only writes down what it is told."""
    script, made = exported
    pv = MagicMock()
    pv.CreateLayout.return_value.SplitVertical.return_value = 1
    monkeypatch.setitem(sys.modules, "paraview", MagicMock(simple=pv))
    monkeypatch.setattr(sys, "argv", [str(script)])
    runpy.run_path(str(script))
    opened = [call.kwargs["FileName"] for call in pv.PVDReader.call_args_list]
    names = ("dem.pvd", "dem_contacts.pvd", "mpm.pvd")
    assert opened == [str(script.parent / name) for name in names]
    table = pv.GetColorTransferFunction
    fastest = max(float(one.seen.ranges["velocity"][1]) for one in made)
    assert [call.args for call in table.call_args_list] == [("velocity",)] * 2
    ranges = [call.args for call in table.return_value.RescaleTransferFunction.call_args_list]
    assert ranges == [(0.0, fastest)] * 2
    assert pv.Tube.call_count == 1 and not pv.SaveScreenshot.called


@pytest.mark.skipif(not shutil.which("pvbatch"), reason="ParaView is not installed")
def test_paraview_draws_it(exported, tmp_path):
    script, _ = exported
    screen = [] if os.environ.get("DISPLAY") else ["xvfb-run", "-a"]
    if screen and not shutil.which("xvfb-run"):
        pytest.skip("no screen")
    words = [*screen, "pvbatch", str(script), str(tmp_path / "a.png"), "0.0"]
    around = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    for _ in range(3):  # xvfb-run's screen may be gone again when ParaView asks for it
        done = subprocess.run(words, capture_output=True, text=True, env=around, check=False)
        if "X server" not in done.stderr:
            break
    assert done.returncode == 0 and not done.stderr, done.stderr
    import matplotlib.image

    picture = matplotlib.image.imread(tmp_path / "a.png")[..., :3]
    height = len(picture) // 2
    for half in (picture[:height], picture[height:]):
        assert np.mean(np.any(half < 0.95, axis=2)) > 0.02  # something is drawn on either side
