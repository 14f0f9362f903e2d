"""Map grains or material points alone: fields, profiles, momentum balance. No case, no continuum.

FILE is grains.h5 of an import, or dem.h5 or mpm.h5 of a run; several are mapped onto one
grid. Written to --out: fields.h5, profiles.csv, figures/, map.html.
"""

import sys
from pathlib import Path

from cases import command_line, results
from cases.errors import CaseError
from cases.provenance import typed

TARGETS = ["grain_map"]


def arguments(parser):
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="what to map")
    parser.add_argument(
        "-o", "--out", type=Path, metavar="DIR", help="folder of the results (runs/map/<file>)"
    )
    parser.add_argument(
        "--dimension",
        type=int,
        choices=[1, 2, 3],
        default=2,
        help="of the fields: over x and y, averaged over z; in space; or profiles (%(default)s)",
    )
    parser.add_argument(
        "--along", choices=["x", "y", "z"], default="y", help="axis of profiles (%(default)s)"
    )
    parser.add_argument("--width", type=float, default=0.75, help="of the kernel [d] (%(default)s)")
    parser.add_argument("--spacing", type=float, help="of the grid [d] (1; of profiles width/4)")
    parser.add_argument(
        "--kernel", choices=["gauss", "lucy", "heaviside", "linear"], help="kernel (gauss)"
    )
    parser.add_argument(
        "--average",
        nargs="*",
        type=float,
        metavar="S",
        help="one average over the frames of a steady flow, or over those FROM one time TO another",
    )
    parser.add_argument(
        "--frame",
        nargs="+",
        type=command_line.whole(0, 10**9),
        default=[],
        metavar="N",
        help="frames to map, counted from 0 (all)",
    )
    parser.add_argument(
        "--width-study", action="store_true", help="also what the kernel's width does to a profile"
    )
    for axis, name in (("x", "--range"), ("y", "--range-y"), ("z", "--range-z")):
        parser.add_argument(
            name,
            nargs=2,
            type=float,
            metavar=("FROM", "TO"),
            help=f"of {axis}, to average over [m] (all)",
        )
    parser.add_argument(
        "--density", type=float, metavar="RHO", help="of grains whose mass no file tells [kg/m3]"
    )
    parser.add_argument(
        "--walls",
        choices=["mirror", "open"],
        default="mirror",
        help="fold back what a kernel puts behind a wall, or let it spread there (%(default)s)",
    )
    parser.add_argument("--quiet", action="store_true", help="show no progress")


def run(options) -> int:
    from compare.maps import page, source  # matplotlib takes its time to load

    check(options)
    files = [source.read(path) for path in options.files]
    request = page.Request(
        options.dimension,
        options.along,
        options.width,
        options.spacing,
        options.kernel,
        options.walls,
        options.average is not None,
        sorted(set(options.frame)),
        words(options),
        options.width_study,
        options.quiet,
    )
    out = options.out or Path("runs") / "map" / files[0].name
    command = typed("./grainpair", sys.argv[1:])

    def say(fraction: float, text: str):
        if not options.quiet:
            print(f"{100 * fraction:3.0f} % {text}", file=sys.stderr, flush=True)

    with results.prepared(out, ["figures"]) as work:
        lines = page.make(files, request, work, command, say)
    for one in files:
        for what, why in one.missing:
            print(f"{one.path}: not told: {what} ({why})")
    print(*lines, sep="\n")
    print(out / "map.html")
    return 0


def check(options):
    for name in ("width", "spacing", "density"):
        value = getattr(options, name)
        if value is not None and not 0.0 < value < float("inf"):
            raise CaseError(f"--{name} {value:g}: not positive")
    if options.average is not None and len(options.average) not in (0, 2):
        raise CaseError("--average: takes no times, or two (FROM TO)")
    names = [path.stem for path in options.files]
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise CaseError(f"{min(twice)}: two files of one name (fields are kept by it) rename one")


def words(options) -> list[str]:
    """Of grain_map: ranges, span of an average, density."""
    out = []
    for axis, name in (("x", "range"), ("y", "range_y"), ("z", "range_z")):
        values = getattr(options, name)
        if values:
            out += [f"--range-{axis}", *map(str, values)]
    if options.average:
        out += ["--span", *map(str, options.average)]
    if options.density:
        out += ["--density", str(options.density)]
    return out
