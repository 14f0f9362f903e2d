"""The flow of a chute as cells to judge laws in: one column of them over its depth, averaged over
the second half of the run. Nothing changes along the flow.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from cases.errors import CaseError
from cases.reading import attributes, opened
from cases.scratch import temporary
from compare.chute import flow, sides
from compare.mapping.runs import Fields, Grid, Run, map_fields


def state(run: Run) -> str:
    """What the layer does in that time (compare/chute/flow.py)."""
    if run.attributes.get("end_reason") == "rest":
        return "stopped"
    velocity = np.array([sides.mean_velocity(cloud) for cloud in run.clouds])
    return flow.state_of(sides.second_half(velocity)[1], run.height / run.time_scale)


def profile(path: Path, width: float) -> Run:
    """The run with one frame, whose fields are the profile of that kernel's width [d]. CaseError
    where the layer stands.
    """
    run = sides.open_chute(path)
    if state(run) == "stopped":
        raise CaseError(
            f"{path}: the layer stands (laws are judged in a flow) take a steeper "
            "geometry.inclination"
        )
    first = len(run.time) // 2
    span = ["--span", repr(float(run.time[first])), repr(float(run.time[-1]))]
    along = ["--dimension", "1", "--along", "y", "--walls", "open", "--average", *span]
    with temporary() as folder:
        made = folder / "profile.h5"
        map_fields([path], made, *along, "--width", str(width), "--spacing", str(width / 1.5))
        with opened(made) as file:
            y, told = file["grid/y"][:], attributes(file)
            values = {
                name: np.asarray(data)[:, :, None]  # (frame, y, x), with one x
                for name, data in file[run.name].items()
                if data.ndim > 1
            }
    geometry = run.case["geometry"]
    volume = float((y[1] - y[0]) * geometry["length"] * geometry["thickness"])
    grid = Grid(np.array([0.5 * geometry["length"]]), y, volume)
    return replace(run, time=run.time[-1:], mapped=Fields(grid, run.time[-1:], values, told))
