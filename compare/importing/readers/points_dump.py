"""Material points in text dumps of LAMMPS' grammar, as Karamelo writes them: stress as s11, s22, …,
and the step always 0, so that the file's name tells it.
"""

from collections.abc import Iterator
from pathlib import Path

from compare.importing import points
from compare.importing.frame import Frame
from compare.importing.readers import text_dump
from compare.importing.registry import Reader, register

PLAIN = ("x", "y", "z", "vx", "vy", "vz", "id", "type", "mass", "density", "volume", "void_ratio")
STRESS = {"s11": "sxx", "s22": "syy", "s33": "szz", "s12": "sxy", "s23": "syz", "s13": "szx"}
NAMES = {name: name for name in PLAIN} | STRESS | {"vol": "volume", "rho": "density"}


def frames(path: Path, options: dict) -> Iterator[Frame]:
    for one in text_dump.frames(path, options):
        known = {NAMES[name]: values for name, values in one.columns.items() if name in NAMES}
        step = one.step if one.step else points.step_of(path)
        yield points.completed(
            Frame(
                one.source, known, one.step if step is None else step, one.time, one.box, one.units
            )
        )


register(
    Reader("points_dump", "Karamelo text dumps of points", "points", text_dump.recognises, frames)
)
