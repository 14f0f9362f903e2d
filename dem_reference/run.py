"""The grains' side of a paired run: CASE -> dem.h5.

    python3 -m dem_reference.run CASE -o dem.h5 [--set key=value]... [--seed N] [--quiet]
        [--progress] [--driver library|script] [--ranks N]
"""

import sys
import time
from dataclasses import replace
from pathlib import Path

import h5py

from cases import command_line
from cases.case import Case, load, stiffness
from cases.errors import CaseError, EngineError
from cases.files import owned
from cases.programs import kept
from cases.scratch import reason

from . import cost, packing, scene, shared
from .checkpoint import Unfinished
from .collapse import collapse
from .plan import Plan
from .content import run_key
from .grains import Grains
from .process import run_engine
from .ranks import refuse_without_mpi, run_on_ranks
from .script import collapse_by_script

PACKING_SHARE = 0.35  # of a run's work, roughly


class Progress:
    """`progress <fraction> <text>` lines, never falling, at most ten a second; or nothing."""

    def __init__(self, wanted: bool):
        self._wanted, self._last, self._done = wanted, 0.0, 0.0

    def part(self, start: float, end: float):
        """A reporter for a share of the whole work."""
        return lambda done, text: self._say(start + (end - start) * min(done, 1.0), text)

    def _say(self, done: float, text: str) -> None:
        self._done = max(self._done, done)
        if self._wanted and (time.monotonic() - self._last > 0.1 or done >= 1):
            self._last = time.monotonic()
            print(f"progress {self._done:.4f} {text}", flush=True)


def run(
    case: Case,
    output: Path,
    seed: int,
    store: Path,
    progress: Progress,
    command: str,
    script: bool,
    ranks: int,
    softness: dict[str, float],
) -> None:
    """Packing, collapse and result file; the file appears complete or not at all. `softness`: what
    of the grains' stiffness the file is to tell.
    """
    tables = packing.dict_of(case)
    refuse(tables, script)
    if ranks > 1:
        refuse_without_mpi(script)
    Plan.of(tables)
    cost.refuse_more_than_there_is(tables)
    takes, interval = cost.estimate(tables), tables["output"]["checkpoint_interval"]
    unfinished = Unfinished.of(output, interval=interval)
    if interval > 0 or unfinished.folder.exists():
        unfinished = replace(unfinished, key=run_key(case, seed, script, ranks))
    # with checkpoints, frames are there twice at the end: in segments, and in the result
    room = takes.disk * (2 if 0 < interval < takes.seconds else 1)
    with owned(output, room, unfinished.remove) as target, unfinished.until_done() as kept:
        settled = packing.obtain(tables, seed, store, progress.part(0.0, PACKING_SHARE))
        with h5py.File(settled / "packing.h5") as made:
            version = made.attrs["engine_version"]
        attributes = {
            "seed": seed,
            "case": case.text,
            "case_resolved": case.resolved,
            "command": command,
            "threads": ranks,
            "engine_version": version,
        } | softness
        target = target.resolve()  # the engine works in a folder of its own
        work = target.with_name(f"{target.name}.work")
        work.mkdir()
        log = work / "log"
        report = progress.part(PACKING_SHARE, 0.99)
        if script:
            collapse_by_script(tables, settled, log, target, attributes, ranks, report)
        elif ranks > 1:
            alone = replace(unfinished, interval=0.0)  # ranks keep nothing half-way
            parts = tables, settled, log, target, attributes, alone
            run_on_ranks(shared.collapse, *parts, ranks=ranks, log=log, report=report)
        else:
            words = tables, settled, log, target, attributes, unfinished, kept
            run_engine(collapse, *words, log=log, report=report)
    progress.part(0, 1)(1.0, "done")


def refuse(case: dict, script: bool = False) -> None:
    """What the grains cannot do, driven by a script or by the library."""
    geometry, d = case["geometry"], Grains.of(case).diameter
    axisymmetric = geometry["dimension"] == "axisymmetric"
    if axisymmetric and case["walls"]["left"] != "smooth":
        raise CaseError(
            "walls.left: an axisymmetric column has no left wall, but an axis (smooth only)"
        )
    if scene.chute(case) and script:
        raise CaseError(
            "geometry.scene: a script does not book the work of gravity along a chute use the "
            "library"
        )
    if axisymmetric and case["walls"]["gate"] == "lifted":
        raise CaseError("walls.gate: a cylindrical gate can only vanish (instantaneous only)")
    # A quarter of a cylinder has no thickness; its bulk box lies 2.5 d from everything.
    for name, least in (
        (("length", 9), ("height", 6))
        if axisymmetric
        else (("thickness", 4), ("length", 6), ("height", 6))
        if scene.chute(case)
        else (("thickness", 2), ("length", 4), ("height", 4))
    ):
        if geometry[name] < least * d:
            raise CaseError(
                f"geometry.{name}: {geometry[name]:g} m is less than {least} grain diameters of "
                f"{d:g} m (grains would meet their own images, or nothing could be poured)"
            )


def parser() -> command_line.Parser:
    out = command_line.Parser(prog="dem_reference.run", description=__doc__.split("\n")[0])
    out.add_argument("case", metavar="CASE", help="case file, or a folder that holds case.toml")
    out.add_argument("-o", "--output", type=Path, required=True, help="result file (HDF5)")
    out.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="override a key of the case"
    )
    out.add_argument(
        "--seed",
        type=command_line.seed,
        default=1,
        help="of base, packing and all random numbers (default 1)",
    )
    out.add_argument(
        "--packings",
        type=Path,
        help="folder that keeps settled packings for reuse",
    )
    out.add_argument(
        "--driver",
        choices=["library", "script"],
        default="library",
        help="drive LIGGGHTS as a library, which splits the dissipation, or by a plain script",
    )
    out.add_argument(
        "--ranks",
        type=command_line.threads,
        default=1,
        help="MPI ranks that share the grains of the collapse (default 1)",
    )
    out.add_argument("--quiet", action="store_true", help="print nothing but errors")
    out.add_argument(
        "--progress", action="store_true", help="print `progress <fraction> <text>` lines"
    )
    return out


def main(words: list[str] | None = None) -> int:
    options = parser().parse_args(words)
    command = " ".join(
        ["python3 -m dem_reference.run", *(sys.argv[1:] if words is None else words)]
    )
    try:
        run(
            load(options.case, options.set),
            options.output,
            options.seed,
            options.packings or kept("packings"),
            Progress(options.progress),
            command,
            options.driver == "script",
            options.ranks,
            stiffness(options.case, options.set)["dem"],
        )
    except CaseError as error:
        print(error, file=sys.stderr)
        return 2
    except OSError as error:
        print(f"{options.output}: cannot be made ({reason(error)})", file=sys.stderr)
        return 3
    except EngineError as error:
        print(error, file=sys.stderr)
        return 3
    return 0


if __name__ == "__main__":
    sys.exit(main())
