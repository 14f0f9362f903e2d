"""What a softer continuum answers: each law on its own stiffness and softened, from displaced
starts that tell chance from effect.

    python3 -m compare.study.softening CASE [--cells N] [--seeds N]

Writes cases/<case>/reference/softening.csv; cases/softening.toml is read off its means, whose
standard errors are printed too. What is `as given` for the laws linear in strain is 1e7 Pa here,
ten times the schema's default: such a skeleton is as stiff as the others.
"""

import sys
from pathlib import Path

import h5py
import pandas as pd

from cases import command_line
from cases.case import load
from cases.errors import exit_code
from cases.files import check_table, write_table
from cases.programs import program
from cases.provenance import about, head, typed
from cases.scratch import temporary
from cases.stages import Stage, run_stages
from compare.study.figures import at_end, figures

LAWS: dict[str, list[str]] = {
    "drucker_prager": ["material.young_modulus=1e7"],
    "mu_i": ["material.young_modulus=1e7"],
    "lade_duncan": [],
    "critical_state": ["material.card=dem_mu05"],
    "solid_fluid": ["material.card=dem_mu05"],
    "solid_fluid, seed_table1": ["material.law=solid_fluid"],
    "contact_share": ["material.card=contact_mu05"],
}
WEIGHTS = (1e-3, 2e-3, 5e-3, 1e-2, 2e-2)
AS_GIVEN = "mpm.stiffness=as given"
DISPLACED = 1e-3  # point spacings: too little to matter but by chance
FIGURES = ("run_out_95", "run_out_99", "centre", "height", "peak")


def stiffnesses(law: str) -> dict[str | float, list[str]]:
    """What a law is run with, by name: also rigid, without the spring of its viscosity."""
    rigid = law.startswith(("solid_fluid", "contact_share"))
    return (
        {"as given": [AS_GIVEN]}
        | ({"rigid": [AS_GIVEN, "mpm.viscous_stiffness=0"]} if rigid else {})
        | {
            weight: ["mpm.stiffness=needed", f"mpm.weight_to_stiffness={float(weight)!r}"]
            for weight in WEIGHTS
        }
    )


def one(scene: Path, law: str, asked: str | float, cells: int, seed: int, folder: Path) -> dict:
    """A run of a law, its figures, its steps and what it cost."""
    size = load(scene)["geometry.height"] / cells
    sets = [f"material.law={law.split(',')[0]}", *LAWS[law], f"mpm.cell_size={float(size)!r}"]
    sets += [f"mpm.jitter={DISPLACED}", "time.maximum=6", "time.frame_interval=1"]
    sets += stiffnesses(law)[asked]
    words = [word for assignment in sets for word in ("--set", assignment)]
    result = folder / "mpm.h5"
    told = [program("mpm_run"), scene, *words, "--seed", seed, "-o", result]
    run_stages([Stage(law, told)], quiet=True)
    found = figures(at_end(result))
    with h5py.File(result) as file:
        energy = file["energy"]
        fluctuation = energy["fluctuation"][()].max() / energy["potential"][0]
        kept = {name: file.attrs[name] for name in ("stiffness_factor", "weight_to_stiffness")}
    return (
        {"law": law, "asked": asked, "seed": seed}
        | kept
        | {name: found[name] for name in (*FIGURES, "steps", "cpu_seconds_engine")}
        | {"fluctuation_peak": fluctuation}
    )


def changes(rows: list[dict]) -> pd.DataFrame:
    """Relative change of each figure's mean from the law as given, and its standard error; run-outs
    as lengths from the wall.
    """
    table = pd.DataFrame(rows)
    for name in FIGURES:
        table[name] += 1.0 if name.startswith("run_out") else 0.0
    groups = table.groupby(["law", "asked"], sort=False)
    mean, error = groups.mean(numeric_only=True), groups[list(FIGURES)].sem()
    out = mean[["weight_to_stiffness", "steps"]].copy()
    for name in FIGURES:
        given = mean[name].xs("as given", level="asked").reindex(mean.index, level="law")
        spread = error[name].xs("as given", level="asked").reindex(mean.index, level="law")
        out[name] = mean[name] / given - 1.0
        out[f"{name}_error"] = (error[name] ** 2 + spread**2) ** 0.5 / given
    return out


def main(words: list[str]) -> int:
    parser = command_line.Parser(prog="compare.study.softening", description=__doc__)
    parser.add_argument("case", type=Path, metavar="CASE", help="folder that holds case.toml")
    parser.add_argument("--cells", type=int, default=16, help="in the height (%(default)s)")
    parser.add_argument("--seeds", type=int, default=3, help="displaced starts (%(default)s)")
    options = parser.parse_args(words)
    target = options.case / "reference" / "softening.csv"
    check_table(target)
    rows = []
    with temporary() as folder:
        for seed in range(1, options.seeds + 1):  # interleaved: all that differs is the stiffness
            for law in LAWS:
                for asked in stiffnesses(law):
                    rows.append(one(options.case, law, asked, options.cells, seed, folder))
                    print(rows[-1], file=sys.stderr, flush=True)
    command = typed("python3 -m compare.study.softening", words)
    notes = (
        "units: asked, weight_to_stiffness rho g H/K [-]; run_out_95, run_out_99, centre, "
        "height [L0]; peak [of what is released]; cpu_seconds_engine [s]; fluctuation_peak [E0]",
    )
    write_table(target, head(about(command), *notes), rows, "%.6g")
    print(changes(rows).to_string(float_format=lambda x: f"{x:.4g}"))
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(sys.argv[1:])))
