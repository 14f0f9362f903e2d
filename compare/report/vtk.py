"""Frames of a run as .vtu files and the .pvd that lists them with their times, for ParaView."""

import shutil
from pathlib import Path
from xml.etree import ElementTree

import h5py
import meshio
import numpy as np

from cases.errors import CaseError
from cases.reading import opened
from cases.scratch import scratch

OMITTED = {"position", "positionOffset"}  # the first are the points, the second is zero


def export(run: Path, folder: Path) -> Path:
    """Writes `folder`/<run>.pvd and `folder`/<run>/<step>.vtu; returns the .pvd.

    Each record of CONTRIBUTING.md becomes point data of its name, SI units: a vector (N, 3), a
    symmetric tensor (N, 6) in the order xx yy zz xy yz zx. Raises CaseError if `run` is no run
    file. Nothing is left of a failed export.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with scratch(folder, run.stem) as work:
        frames = work / run.stem
        frames.mkdir()
        listing = ElementTree.Element("VTKFile", type="Collection", version="0.1")
        collection = ElementTree.SubElement(listing, "Collection")
        try:
            with opened(run) as file:
                for step in sorted(file["data"], key=int):
                    frame = file["data"][step]
                    mesh(frame["particles/cloud"]).write(frames / f"{step}.vtu")
                    ElementTree.SubElement(
                        collection,
                        "DataSet",
                        timestep=repr(float(frame.attrs["time"])),
                        part="0",
                        file=f"{run.stem}/{step}.vtu",
                    )
        except (OSError, KeyError) as error:
            raise CaseError(
                f"{run}: not a run file ({error}). Give mpm.h5 or dem.h5 of a run"
            ) from error
        ElementTree.ElementTree(listing).write(
            work / "all.pvd", xml_declaration=True, encoding="utf-8"
        )
        shutil.rmtree(folder / run.stem, ignore_errors=True)
        frames.rename(folder / run.stem)
        return (work / "all.pvd").rename(folder / f"{run.stem}.pvd")


def mesh(cloud: h5py.Group) -> meshio.Mesh:
    """A cloud as one vertex cell per particle."""

    def values(record):
        if isinstance(record, h5py.Dataset):
            return record[()]
        order = ("x", "y", "z") if "x" in record else ("xx", "yy", "zz", "xy", "yz", "zx")
        return np.column_stack([record[component][()] for component in order])

    points = values(cloud["position"])
    return meshio.Mesh(
        points,
        [("vertex", np.arange(len(points))[:, None])],
        point_data={name: values(record) for name, record in cloud.items() if name not in OMITTED},
    )
