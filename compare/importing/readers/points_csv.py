"""Material points in tables with headings: positions, velocities, masses or densities and volumes,
stresses.
"""

from collections.abc import Iterator
from pathlib import Path

from compare.importing import headed, points
from compare.importing.frame import Frame
from compare.importing.registry import Reader, register


def frames(path: Path, options: dict) -> Iterator[Frame]:
    """One frame for each value of a time or step column; without either, one."""
    for frame in headed.frames(path, options):
        if frame.step is None and frame.time is None:
            frame.step = points.step_of(path)
        yield points.completed(frame)


register(
    Reader("points_csv", "tables of points with headings", "points", headed.recognises, frames)
)
