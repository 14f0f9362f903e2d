"""A comparison: the runs of a folder, paired, and every metric of them."""

import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compare.verdict import equivalence as verdict
from cases.errors import CaseError, EngineError
from compare.metrics import Metric, all_metrics
from cases.programs import call, program
from compare.mapping.runs import Run, open_fields, open_run


@dataclass
class Comparison:
    """Runs of both engines; the first of each is the one that figures show, the others give the
    scatter.
    """

    mpm: list[Run]
    dem: list[Run]
    width_study: object = None  # a WidthStudy of compare.report, when one was asked for

    @property
    def first(self) -> tuple[Run, Run]:
        return self.mpm[0], self.dem[0]


def run_files(folder: Path) -> tuple[list[Path], list[Path]]:
    """mpm*.h5 and dem*.h5 of a run's folder, mpm.h5 and dem.h5 first."""
    mpm, dem = (
        sorted(folder.glob(f"{engine}*.h5"), key=lambda p: (len(p.stem), p.stem))
        for engine in ("mpm", "dem")
    )
    for engine, files in (("mpm", mpm), ("dem", dem)):
        if not files:
            raise CaseError(
                f"{folder}: no {engine}.h5 (not a run's folder?). Make one with: grainpair run"
            )
    return mpm, dem


def map_fields(runs: list[Path], output: Path, *options):
    """Calls grain_map; raises EngineError with its line when it fails."""
    command = [program("grain_map"), *runs, "-o", output, "--quiet", *options]
    environment = os.environ | {
        "GOMP_SPINCOUNT": "0"
    }  # waiting threads leave the cores to the engines
    done = call(command, env=environment)
    if done.returncode:
        raise EngineError(done.stderr.strip() or f"grain_map: failed with code {done.returncode}")


def refuse_unpaired(runs: list[Run]):
    """The same scene on both sides: geometry, gravity and grains must agree, or no number below
    means anything.
    """
    keys = (
        "geometry.height",
        "geometry.length",
        "geometry.thickness",
        "geometry.gravity",
        "grains.diameter",
        "grains.density",
    )
    for run in runs[1:]:
        for key in keys:
            if not math.isclose(run.case[key], runs[0].case[key], rel_tol=1e-12):
                raise CaseError(
                    f"{run.case.path}: {key} = {run.case[key]} but {runs[0].case[key]} in "
                    f"{runs[0].case.path} (not runs of one scene)"
                )


def pair(mpm: list[Run], dem: list[Run], same_scene: bool = True) -> Comparison:
    """Brings both sides to one mass and one energy scale.

    Where the continuum started from the nominal void ratio its mass differs from the packing's by
    the void ratio the packing reached; masses and energies of every run are scaled to the first
    grain run's mass.
    """
    if same_scene:
        refuse_unpaired(mpm + dem)
    for run in mpm + dem:
        run.mass_scale = dem[0].mass / run.mass
    scale = float(np.mean([run.released() for run in dem]))
    for run in mpm + dem:
        run.reference_energy = scale
    return Comparison(mpm, dem)


def load(folder: Path) -> Comparison:
    """The comparison of a folder whose fields.h5 is there."""
    mpm, dem = ([open_run(path) for path in files] for files in run_files(folder))
    for run in mpm + dem:
        run.mapped = open_fields(folder / "fields.h5", run.name)
    return pair(mpm, dem)


def margin_of(metric: Metric, run: Run, mean: float) -> float | None:
    """The metric's margin in its own unit, from the case of `run`; None when the case has none for
    it.

    `run` is one of the continuum: grains that are kept for all cases that ask for them may stem
    from one of other margins.
    """
    if not metric.margin:
        return None
    share = run.case[metric.margin]
    grain = run.diameter / run.length  # nothing is known to better than a grain
    if metric.margin == "compare.margin_run_out":
        return max(share * (1.0 + mean), grain)
    if metric.margin == "compare.margin_height":
        return max(share * mean, grain)
    return share


def number(x: float) -> float | None:
    """JSON has no NaN."""
    return float(x) if math.isfinite(x) else None


def spread(values: list[float]) -> dict:
    """Runs of an ensemble, kept only when there is more than one."""
    return (
        {"runs": [number(v) for v in values], "std": number(float(np.std(values, ddof=1)))}
        if len(values) > 1
        else {}
    )


def evaluate_one(metric: Metric, c: Comparison) -> dict:
    """One entry of metrics.json."""
    about = {"unit": metric.unit, "definition": metric.definition, "source": metric.source}
    if metric.of_pair:
        values = [metric(c.mpm[0], dem) for dem in c.dem]
        entry = {"value": number(float(np.mean(values)))} | spread(values)
        if len(c.dem) > 1:  # what the grains differ by among themselves
            noise = [metric(a, b) for i, a in enumerate(c.dem) for b in c.dem[i + 1 :]]
            entry["noise_floor"] = number(float(np.mean(noise)))
        margin, judged = margin_of(metric, c.mpm[0], 0.0), lambda m: verdict.distance(values, m)
    else:
        mpm, dem = [metric(run) for run in c.mpm], [metric(run) for run in c.dem]
        a, b = float(np.mean(mpm)), float(np.mean(dem))
        entry = {
            "mpm": number(a),
            "dem": number(b),
            "difference": number(a - b),
            "relative_difference": number(a / b - 1.0 if b else math.nan),
        }
        entry |= {
            f"{engine}_{k}": v
            for engine, values in (("mpm", mpm), ("dem", dem))
            for k, v in spread(values).items()
        }
        margin, judged = margin_of(metric, c.mpm[0], b), lambda m: verdict.equivalence(mpm, dem, m)
    if margin is not None:
        v = judged(margin)
        entry |= {"margin": margin, "half_width": number(v.half_width), "verdict": v.word}
    return entry | about


def evaluate(c: Comparison) -> dict[str, dict]:
    """metrics.json: every metric by name, and the scale of the pairing."""
    out = {name: evaluate_one(metric, c) for name, metric in sorted(all_metrics().items())}
    out["mass_scale"] = {
        "value": c.mpm[0].mass_scale,
        "unit": "-",
        "source": "pairing",
        "definition": (
            "Factor on the continuum's mass and energies that makes both clouds weigh the same."
        ),
    }
    out["verdict"] = {
        "value": verdict.overall([e["verdict"] for e in out.values() if "verdict" in e]),
        "unit": "-",
        "source": "equivalence tests against the case's margins",
        "definition": (
            "agree, differ or unresolved for ensembles; within or outside margin for one pair."
        ),
    }
    return out
