"""Frames for ParaView hold what the run file holds."""

from xml.etree import ElementTree

import h5py
import meshio
import numpy as np
import pytest

from compare.report import vtk
from cases.errors import CaseError
import synthetic


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "mpm.h5"
    synthetic.write_run(path, "mpm")
    return path


def test_every_frame_and_its_time_is_listed(run, tmp_path):
    listed = ElementTree.parse(vtk.export(run, tmp_path)).getroot().findall("Collection/DataSet")
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
