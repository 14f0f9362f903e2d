"""Plane strain against the slab of [Ceccato2019]: difference and cost, as a table.

The slab is one cell thick, between rollers. Each row is one run of the continuum. The slab's points
stand in pairs across its thickness, so that plane strain is its exact solution; what is left of a
difference is numerical. --scatter gives the scale: plane strain again, from points displaced by
1e-10 of their spacing.
"""

import math
import sys
from pathlib import Path

import pandas as pd

from cases import case, command_line, provenance
from cases.lookup import find_case
from cases.scenes import refuse_chute
from cases.stages import Stage, run_stages
from cases.errors import CaseError
from cases.files import check_table, write_table
from cases.programs import program
from cases.scratch import temporary
from compare.study.figures import JITTER, at_end, figures


def arguments(parser):
    parser.add_argument(
        "case",
        nargs="?",
        default="column",
        metavar="CASE",
        help="case file, folder that holds case.toml, or name (%(default)s)",
    )
    command_line.add_overrides(parser)
    parser.add_argument(
        "--scatter",
        type=command_line.whole(0, 10_000),
        default=0,
        metavar="N",
        help="further runs in plane strain, perturbed (%(default)s)",
    )
    parser.add_argument(
        "--table",
        type=Path,
        metavar="FILE",
        help="keep the rows as CSV; rows of other settings that it holds stay",
    )
    parser.add_argument("--quiet", action="store_true", help="show no progress")


def run(options) -> int:
    scene = case.load(find_case(options.case), options.overrides)
    refuse_chute(scene, "dimensions are compared")
    if options.table:
        check_rows(options.table)
    sets = [*options.overrides, f"geometry.thickness={float(scene['mpm.cell_size'])!r}"]
    # The step's limit falls as 1/√(dimensions) where stiffness sets it; there the scaled fraction
    # gives the slab the steps of plane strain.
    equal = f"mpm.time_step_fraction={float(scene['mpm.time_step_fraction'] * math.sqrt(1.5))!r}"
    plans: list[tuple[str, int, list[str]]] = [
        ("plane strain", 1, []),
        ("slab", 1, ["geometry.dimension=three_dimensional"]),
        ("slab, step of plane strain", 1, ["geometry.dimension=three_dimensional", equal]),
    ]
    plans += [
        ("plane strain, perturbed", seed, [f"mpm.jitter={JITTER}"])
        for seed in range(1, options.scatter + 1)
    ]
    rows = []
    for name, seed, more in plans:
        with temporary() as folder:
            result = folder / "mpm.h5"
            words = [word for assignment in sets + more for word in ("--set", assignment)]
            run_stages(
                [
                    Stage(
                        name,
                        [
                            program("mpm_run"),
                            scene.path,
                            *words,
                            "--seed",
                            seed,
                            "--progress",
                            "-o",
                            result,
                        ],
                    )
                ],
                quiet=options.quiet,
            )
            rows.append(
                {
                    "settings": " ".join(options.overrides) or "as the case says",
                    "kinematics": name,
                    "seed": seed,
                }
                | figures(at_end(result))
            )
    table = pd.DataFrame(rows)
    table["cost"] = table["cpu_seconds_engine"] / table["cpu_seconds_engine"].iloc[0]
    print(table.drop(columns="settings").to_string(index=False, float_format=lambda x: f"{x:.4g}"))
    if options.table:
        keep(table, options.table)
        print(options.table)
    return 0


def check_rows(path: Path):
    """Raises CaseError where the rows cannot be kept beside those that are there."""
    check_table(path)
    if path.exists() and "settings" not in pd.read_csv(path, comment="#"):
        raise CaseError(f"{path}: is the table of another command give another name")


def keep(table: pd.DataFrame, path: Path):
    if path.exists():
        others = pd.read_csv(path, comment="#")
        table = pd.concat([others[~others["settings"].isin(table["settings"])], table])
    origin = provenance.about(provenance.typed("./grainpair", sys.argv[1:]))
    del origin["commit"]  # every row has its solver's
    head = provenance.head(
        origin,
        "run_out [L0] by 99.5 and 99 % of the mass; height [L0] of the free surface; peak_time, "
        "until [sqrt(H/g)]; peak and energies over the energy released; solver: commit of mpm_run; "
        "cost: the solver's own processor time over plane strain's",
    )
    write_table(path, head, table)
