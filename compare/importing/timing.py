"""What an import takes, of files that are made for it and removed again.

    python3 -m compare.importing.timing [--grains N] [--frames K] [-o TABLE.csv]

Text: a dump of N grains in K frames, eleven columns of six digits. MercuryDPM: a cubic lattice of
N/6 grains with its contacts, about N rows a frame, each contact twice as its programs write it.
"""

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from cases import children, command_line, provenance
from cases.errors import EngineError, exit_code
from cases.files import check_table, write_table
from cases.programs import module
from cases.scratch import temporary

D = 1e-3  # m, of the grains
DEEP = 1e-5  # m, overlap of neighbours in the lattice


def rows_of(columns: list[np.ndarray]) -> str:
    """Rows of numbers with six digits."""
    table = pd.DataFrame(dict(enumerate(columns)))
    return table.to_csv(sep=" ", header=False, index=False, float_format="%.6g")


def lattice(side: int) -> np.ndarray:
    """Places (side³, 3) [m]."""
    axes = [D / 2 + (D - DEEP) * np.arange(side)] * 3
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def text_dump(folder: Path, grains: int, frames: int) -> tuple[list[str], int]:
    """Writes a dump; returns the words of the import, and the number of rows."""
    rng = np.random.default_rng(1)
    place = rng.permutation(lattice(round(grains ** (1 / 3))))
    count, top = len(place), float(place.max() + D)
    speed = rng.normal(0.0, 0.1, (3, count))
    same = [np.full(count, D / 2), np.full(count, 2500.0)]
    rows = rows_of([np.arange(1, count + 1), np.ones(count, int), *place.T, *speed, *same])
    box = "\n".join(3 * [f"0 {top:g}"])
    with (folder / "grains.dump").open("w") as file:
        for step in range(frames):
            file.write(f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{count}\n")
            file.write(f"ITEM: BOX BOUNDS ff ff ff\n{box}\n")
            file.write(f"ITEM: ATOMS id type x y z vx vy vz radius density\n{rows}")
    return [str(folder / "grains.dump"), "--time-step", "1e-3"], count * frames


def mercury(folder: Path, grains: int, frames: int) -> tuple[list[str], int]:
    """The same of particles and contacts; rows are those of contacts."""
    side = round((grains / 6) ** (1 / 3))
    place = lattice(side)
    count, top = len(place), side * D
    number = np.arange(count).reshape(side, side, side)
    pairs = [np.moveaxis(number, axis, 0) for axis in range(3)]
    i = np.concatenate([one[1:].ravel() for one in pairs])
    j = np.concatenate([one[:-1].ravel() for one in pairs])
    normal = (place[j] - place[i]) / (D - DEEP)
    zero, one = np.zeros(2 * len(i)), np.ones(2 * len(i))
    first, second = np.concatenate([i, j]), np.concatenate([j, i])
    normal = np.concatenate([normal, -normal])
    touch = place[first] + 0.5 * (D - DEEP) * normal
    heads = [zero, first, second, *touch.T, DEEP * one, zero, -0.1 * one, zero]
    contacts = rows_of([*heads, *normal.T, zero, zero, zero])
    still, some = np.zeros(count), np.full(count, 0.1)
    particles = rows_of([*place.T, some, some, some, np.full(count, D / 2), *[still] * 7])
    corners = f"0 0 0 {top:g} {top:g} {top:g}"
    with (folder / "a.data").open("w") as data, (folder / "a.fstat").open("w") as fstat:
        for step in range(frames):
            data.write(f"{count} {step} {corners}\n{particles}")
            fstat.write(f"# {step} 1\n# {corners}\n# {D / 2} {D / 2} 0 0 0 0\n{contacts}")
    words = [str(folder / "a.data"), "--contacts-from", str(folder / "a.fstat")]
    return [*words, "--density", "2500"], len(first) * frames


def imported(words: list[str], folder: Path) -> dict[str, float]:
    """Seconds and memory [GB] of an import, in a process of its own."""
    command = module("compare", "import", *words, "--up", "y", "--quiet", "-o", folder / "out.h5")
    began = time.monotonic()
    with children.start(command, stdout=subprocess.DEVNULL) as job:
        _, status, used = os.wait4(job.pid, 0)
        job.returncode = os.waitstatus_to_exitcode(status)
    if job.returncode:
        raise EngineError(f"import of {words[0]}: failed with code {job.returncode}")
    return {
        "wall_s": time.monotonic() - began,
        "cpu_s": used.ru_utime + used.ru_stime,
        "memory_GB": used.ru_maxrss / 1e6,
    }


def measured(make: Callable, grains: int, frames: int) -> dict[str, Any]:
    """A row of the table."""
    with temporary() as name:
        words, rows = make(name, grains, frames)
        size = sum(path.stat().st_size for path in name.iterdir()) / 1e9
        told = {"files": make.__name__, "rows": rows, "frames": frames, "size_GB": size}
        return told | imported(words, name)


def main() -> int:
    parser = command_line.Parser(
        prog="compare.importing.timing", description=(__doc__ or "").split("\n")[0]
    )
    count = command_line.whole(1000, 10**8)
    parser.add_argument("--grains", type=count, default=10**6, help="(%(default)s)")
    parser.add_argument(
        "--frames", type=command_line.whole(1, 1000), default=10, help="(%(default)s)"
    )
    parser.add_argument("-o", "--output", type=Path, help="table (CSV)")
    options = parser.parse_args()
    if options.output:
        check_table(options.output)
    rows = [measured(make, options.grains, options.frames) for make in (text_dump, mercury)]
    print(pd.DataFrame(rows).to_string(index=False))
    if options.output:
        command = f"python3 -m compare.importing.timing --grains {options.grains} "
        about = provenance.about(f"{command}--frames {options.frames} -o {options.output}")
        note = "rows: of grains, or of contacts where there are; size of the files; peak memory"
        write_table(options.output, provenance.head(about, note), rows)
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(main))
