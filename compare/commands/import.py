"""Import grains of other programs into one file, in SI units and our axes.

FILES are what LAMMPS, LIGGGHTS and others wrote, in any order, or folders or quoted patterns of
such: frames of one run, per process or after restarts, compressed or not. What is assumed or odd is
said, and stands in the file.
"""

from pathlib import Path

import h5py
import numpy as np

from cases import case
from cases.errors import CaseError
from cases.reading import attributes, opened
from compare.importing import axes, points_file
from compare.importing import options as importing
from compare.importing.pipeline import convert
from compare.importing.points_file import PointOptions

PACKAGES = ["studies"]
TARGETS = ["mpm_case"]


def arguments(parser):
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="frames of the run")
    parser.add_argument(
        "-o", "--output", type=Path, required=True, metavar="FILE", help="the grains"
    )
    parser.add_argument("--force", action="store_true", help="replace a file that is there")
    parser.add_argument("--quiet", action="store_true", help="show no progress and no summary")
    importing.arguments(parser)
    group = parser.add_argument_group("material points of other MPM codes")
    group.add_argument("--continuum", action="store_true", help="FILES hold points, not grains")
    sign = group.add_mutually_exclusive_group()
    sign.add_argument("--tension-positive", action="store_true", help="stress in the files")
    sign.add_argument("--compression-positive", action="store_true", help="stress in the files")


def run(options) -> int:
    if options.output.exists() and not options.force:
        raise CaseError(f"{options.output}: is there (it would be lost) give another, or --force")
    same = [one for one in options.files if one.resolve() == options.output.resolve()]
    if same:
        raise CaseError(f"{options.output}: is one of the files to import")
    scene = case.load(options.case) if options.case else None
    if options.continuum:
        return points(options, scene)
    words = importing.Options.of(options.files, options)
    notes = convert(words, scene, options.output, options.quiet)
    if not options.quiet:
        print("\n".join(summary(options.output)))
        for note in notes:
            print(note)
    print(options.output)
    return 0


def points(options, scene: case.Case | None) -> int:
    """Material points instead of grains."""
    up = options.up or "y"
    turned = axes.Axes.of(up, options.flow or next(word for word in "xyz" if word != up[-1]))
    sign = {True: True, False: False if options.compression_positive else None}
    words = PointOptions(
        tension=sign[options.tension_positive],
        case=scene,
        density=options.density,
        diameter=options.diameter,
        time_step=options.time_step,
        turn=turned.turn,
        origin=np.array(options.origin or (0.0, 0.0, 0.0)),
        gravity=turned.vectors(np.array(options.gravity)) if options.gravity else None,
        up_told=options.up is not None,
    )
    reading = {"columns": options.columns} | (
        {"incomplete": "drop"} if options.skip_incomplete else {}
    )
    notes = points_file.convert(options.files, words, options.output, options.format, reading)
    if not options.quiet:
        for note in notes:
            print(note)
    print(options.output)
    return 0


def summary(path: Path) -> list[str]:
    """What a file of grains holds, line by line."""
    with opened(path) as file:
        told, frames = attributes(file), sorted(file["data"], key=int)
        first = file["data"][frames[0]]
        kind = first["particles/cloud/kind"][:]
        times = [file["data"][step].attrs["time"] for step in (frames[0], frames[-1])]
        lines = [
            f"{told['engine_version']}: {len(kind)} grains, {np.sum(kind == 3)} of them wall; "
            f"{len(frames)} frame{'s' if len(frames) > 1 else ''}, {span(times)}",
            f"d = {1e3 * told['diameter']:.4g} mm ({1e3 * told['diameter_min']:.4g} to "
            f"{1e3 * told['diameter_max']:.4g}), {told['density']:.4g} kg/m3, gravity "
            f"({', '.join(f'{g:.4g}' for g in told['gravity'])}) m/s2",
            f"contacts: {contacts(file, frames)}",
            *box(first, told),
        ]
    return lines


def span(times: list[float]) -> str:
    if not np.isfinite(times).all():
        return "times not told"
    return f"t = {times[0]:.4g} to {times[1]:.4g} s"


def contacts(file: h5py.File, frames: list[str]) -> str:
    told = [step for step in frames if "contacts" in file["data"][step]]
    if not told:
        return "none told, so no stress of contacts"
    last = file["data"][told[-1]]["contacts"]
    return f"in {len(told)} of {len(frames)} frames, {len(last['first'])} in the last"


def box(first: h5py.Group, told) -> list[str]:
    """Along x, y and z: where the domain begins and ends, repeats and has walls."""
    out = []
    for k, name in enumerate(("x, along the flow", "y, up", "z, across")):
        low, high = (1e3 * first.attrs[f"box_{side}"][k] for side in ("lower", "upper"))
        words = "no box" if np.isnan(low) else f"{low:.4g} to {high:.4g} mm"
        walls = [1e3 * told[f"wall_{side}"][k] for side in ("low", "high")]
        walls = [f"{wall:.4g} mm" for wall in walls if np.isfinite(wall)]
        words += ", periodic" if told["periodic"][k] else ""
        out.append(f"{name}: {words}" + (f", wall at {' and '.join(walls)}" if walls else ""))
    return out
