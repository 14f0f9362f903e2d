"""Write the particles and contacts of a run as .pvd and .vtu, which ParaView opens.

RUN is a folder that holds mpm.h5, dem.h5 or grains.h5, or one such file. For each file,
<folder>/vtk/<name>.pvd lists the frames with their times, <name>_contacts.pvd those of its contacts
as lines. open_in_paraview.py beside them shows both sides, coloured alike.
"""

from pathlib import Path

from cases import results
from cases.errors import CaseError
from compare.mapping.clouds import open_grains

PACKAGES = ["studies"]
TARGETS = ()
KINDS = ("mpm", "dem", "grains")


def arguments(parser):
    parser.add_argument(
        "source", type=Path, metavar="RUN", help="folder of a run, or a result file"
    )
    parser.add_argument(
        "--out", type=Path, help="folder to write to (vtk/ beside the result files)"
    )


def run(options) -> int:
    from compare.report import paraview, vtk  # of packages-studies.txt

    files = (
        sorted(file for name in KINDS for file in options.source.glob(f"{name}*.h5"))
        if options.source.is_dir()
        else [options.source]
    )
    if not files or not files[0].exists():
        raise CaseError(
            f"{options.source}: no run to export (neither a folder that holds mpm.h5, dem.h5 or "
            "grains.h5, nor a file). Make one with: ./grainpair run"
        )
    folder = options.out or files[0].parent
    place = "" if options.out else "vtk/"
    names = [f"{file.stem}{end}" for file in files for end in ("", "_contacts")]
    ours = [f"{place}{name}{end}" for name in names for end in ("", ".pvd")]
    with results.prepared(folder, [*ours, f"{place}{paraview.NAME}"]) as work:
        made = [vtk.export(file, work / place) for file in files]
        engines = [open_grains(file).engine for file in files]
        script = paraview.write(made, engines, work / place, folder / place)
    listed = [path for one in made for path in (one.particles, one.contacts) if path]
    print(*(folder / place / path.name for path in [*listed, script]), sep="\n")
    return 0
