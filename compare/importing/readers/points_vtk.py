"""Material points in VTK files, as Anura3D writes them: of each step three files, …_MPScalar_…,
…_MPVector_… and …_MPTensor_… (src/WriteVTKOutput.FOR there), which are joined by their step.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from compare.importing import points
from compare.importing.frame import Frame
from compare.importing.readers import vtk_grains
from compare.importing.registry import Reader, register


def frames(path: Path, options: dict) -> Iterator[Frame]:
    for one in vtk_grains.frames(path, options):
        arrays = gathered(one.columns)
        place = np.stack([one.columns[axis] for axis in "xyz"], axis=1)
        frame = points.frame_of(arrays | {"position": place}, one.source)
        frame.time = one.time if frame.time is None else frame.time
        frame.step = points.step_of(path) if one.step is None else one.step
        yield frame


def gathered(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Arrays whose components vtk_grains made columns of: "namex", … and "name[1]", …."""
    vectors: dict[str, list[str]] = {}
    for name in columns:
        found = re.fullmatch(r"(.{2,})[xyz]|(.+)\[\d+\]|(v)[xyz]", name)
        if found:
            vectors.setdefault(found[1] or found[2] or found[3], []).append(name)
    whole = {k: v for k, v in vectors.items() if len(v) > 2}
    parts = {name for names in whole.values() for name in names}
    out = {name: values for name, values in columns.items() if name not in {*parts, *"xyz"}}
    for name, names in whole.items():
        out[name] = np.stack([columns[one] for one in names], axis=1)
    return out


register(
    Reader(
        "points_vtk", "material points in VTK (Anura3D)", "points", vtk_grains.recognises, frames
    )
)
