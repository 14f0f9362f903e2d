"""Negative controls: candidates that must not pass for the continuum. A comparison that lets one
pass proves nothing.

shuffled            the continuum's own instants and energy rows in random order; costs nothing,
                    always tried
over_frictional     the continuum with about twice the friction, in controls/over_frictional.h5
other_aspect_ratio  grains of a column half as high, in controls/other_aspect_ratio.h5, in the
                    continuum's place

The last two are runs of their own; `make` runs what is missing.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from compare.verdict import equivalence as verdict
from compare.verdict.comparison import Comparison, evaluate_one, pair
from cases.stages import Stage, run_stages
from compare.metrics import all_metrics
from cases.programs import module, program
from cases.scratch import temporary
from compare.mapping.runs import Fields, Run, open_fields, open_run

WORDS = {
    "shuffled": "the continuum's instants in random order",
    "over_frictional": "a continuum with twice the friction",
    "other_aspect_ratio": "grains of a column half as high",
}
JUDGED_FIELDS = ("solid_fraction", "density", "velocity")  # what metrics read


@dataclass(frozen=True)
class Control:
    name: str
    words: dict[str, str]  # metric -> verdict

    @property
    def rejected(self) -> bool:
        deciding = [word for name, word in self.words.items() if all_metrics()[name].decides]
        return verdict.overall(deciding) in (verdict.DIFFER, verdict.OUTSIDE)


def files(folder: Path) -> list[Path]:
    """Runs of controls that a folder holds."""
    return [p for name in WORDS if (p := folder / "controls" / f"{name}.h5").exists()]


def shuffled(run: Run, seed: int = 1) -> Run:
    """The run with its frames, and the rows of its energy history, in random order at the old
    times.
    """
    random = np.random.default_rng(seed)
    order, rows = random.permutation(len(run.time)), random.permutation(len(run.energy["time"]))
    energy = {k: v if k == "time" else v[rows] for k, v in run.energy.items()}
    fields = Fields(
        run.fields.grid, run.fields.time, {k: run.fields[k][order] for k in JUDGED_FIELDS}
    )
    clouds = [run.clouds[i] for i in order]
    return replace(run, clouds=clouds, energy=energy, mapped=fields, dissipation=None)


def judge(name: str, candidate: Run, c: Comparison) -> Control:
    """The candidate in the continuum's place, against the same grains with the same margins."""
    trial = replace(pair([candidate], c.dem, same_scene=False), packings=c.packings)
    entries = {m.name: evaluate_one(m, trial) for m in all_metrics().values() if m.margin}
    return Control(name, {k: e["verdict"] for k, e in entries.items()})


def judge_all(c: Comparison, folder: Path) -> list[Control]:
    """Every control whose run is there; fields.h5 of the folder holds their fields."""
    controls = [judge("shuffled", shuffled(c.mpm[0]), c)]
    for path in files(folder):
        run = open_run(path)
        run.mapped = open_fields(folder / "fields.h5", run.name)
        controls.append(judge(run.name, run, c))
    return controls


def entries(controls: list[Control]) -> dict[str, dict]:
    """As metrics.json shows them."""
    return {
        f"control_{control.name}": {
            "value": "rejected" if control.rejected else "NOT REJECTED",
            "unit": "-",
            "source": "negative control",
            "definition": (
                f"Whether {WORDS[control.name]}, put in the continuum's place, is found to differ "
                "from the grains."
            ),
            "words": control.words,
        }
        for control in controls
    }


def make(folder: Path, mpm: Run, dem: Run, quiet: bool = False):
    """Runs the controls that the folder lacks, with the engines and cases that made its runs."""
    target = folder / "controls"
    target.mkdir(exist_ok=True)
    with temporary() as scratch:
        scenes = {}
        for run in (mpm, dem):
            scenes[run.engine] = scratch / f"{run.engine}.toml"
            scenes[run.engine].write_text(run.case.resolved)
        friction = [
            f"material.stress_ratio={min(2.0, 2.0 * mpm.case['material.stress_ratio'])}",
            "material.static_friction=2.0",
            "material.dynamic_friction=3.0",
        ]
        commands: dict[str, list] = {
            "over_frictional": [
                program("mpm_run"),
                scenes["mpm"],
                *(w for key in friction for w in ("--set", key)),
            ],
            "other_aspect_ratio": [
                *module("dem_reference.run", scenes["dem"]),
                *("--set", f"geometry.height={0.5 * dem.height}"),
                *("--seed", str(dem.attributes["seed"])),
            ],
        }
        for name, command in commands.items():
            if not (target / f"{name}.h5").exists():
                run_stages(
                    [
                        Stage(
                            f"control: {name.replace('_', ' ')}",
                            [*command, "--progress", "-o", target / f"{name}.h5"],
                        )
                    ],
                    quiet=quiet,
                )
