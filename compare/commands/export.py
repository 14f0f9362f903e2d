"""Write the particles of a run as .pvd and .vtu, which ParaView opens.

RUN is a folder that holds mpm.h5 and dem.h5, or one such file. For each file,
<folder>/vtk/<name>.pvd lists the frames with their times.
"""

from pathlib import Path

from cases import results
from cases.errors import CaseError
from compare.report import vtk

TARGETS = ()


def arguments(parser):
    parser.add_argument(
        "source", type=Path, metavar="RUN", help="folder of a run, or a result file"
    )
    parser.add_argument(
        "--out", type=Path, help="folder to write to (vtk/ beside the result files)"
    )


def run(options) -> int:
    files = (
        sorted([*options.source.glob("mpm*.h5"), *options.source.glob("dem*.h5")])
        if options.source.is_dir()
        else [options.source]
    )
    if not files or not files[0].exists():
        raise CaseError(
            f"{options.source}: no run to export (neither a folder that holds mpm.h5 or dem.h5, "
            "nor a file). Make one with: ./grainpair run"
        )
    folder = options.out or files[0].parent
    place = "" if options.out else "vtk/"
    ours = [f"{place}{name}" for file in files for name in (file.stem, f"{file.stem}.pvd")]
    with results.prepared(folder, ours) as work:
        made = [vtk.export(file, work / place).name for file in files]
    print(*(folder / place / name for name in made), sep="\n")
    return 0
