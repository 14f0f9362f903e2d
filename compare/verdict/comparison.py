"""A comparison: the runs of a folder, paired, and every metric of them."""

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from compare.verdict import equivalence as verdict
from compare.verdict import siblings
from cases.case import Case
from cases.errors import CaseError
from compare.metrics import Metric, all_metrics
from compare.mapping.runs import SCENE, Run, open_fields, open_run
from compare.verdict.packings import Packings, of_run
from dem_reference.grains import mapped_diameter

SAME = 0.01  # relative: what imported grains may differ from the case's to be packed like them


@dataclass
class Comparison:
    """Runs of both engines; the first of each is the one that figures show, the others give the
    scatter.
    """

    mpm: list[Run]
    dem: list[Run]
    width_study: object = None  # a WidthStudy of compare.report, when one was asked for
    # what a metric may be off by for the continuum's numerics, by name, in the metric's unit
    numerical_uncertainty: dict[str, float] = field(default_factory=dict)
    no_siblings: str = ""  # why that is not known, where it was tried
    packings: Packings | None = None  # the stored scatter, for a single packing

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


def refuse_unpaired(runs: list[Run]):
    """The same scene on both sides: geometry, gravity and grains must agree, or no number below
    means anything.
    """
    for run in runs[1:]:
        for key in SCENE:
            if not math.isclose(run.case[key], runs[0].case[key], rel_tol=1e-12):
                raise CaseError(
                    f"{run.case.path}: {key} = {run.case[key]} but {runs[0].case[key]} in "
                    f"{runs[0].case.path} (not runs of one scene)"
                )


def pair(mpm: list[Run], dem: list[Run], same_scene: bool = True) -> Comparison:
    """Brings both sides to one mass and one energy scale.

    Where the continuum started from the nominal void ratio its mass differs from the packing's by
    the void ratio the packing reached; masses and energies of every run are scaled to the first
    grain run's mass. Where they release no energy, or nobody knows it, figures over it are NaN.
    """
    if same_scene:
        refuse_unpaired(mpm + dem)
    for run in mpm + dem:
        run.mass_scale = dem[0].mass / run.mass
        run.grain = dem[0].diameter
    released = float(np.mean([run.released() for run in dem]))
    scale = released if released > 0.0 else math.nan  # figures over E0 are undefined then
    for run in mpm + dem:
        run.reference_energy = scale
    return Comparison(mpm, dem)


def load(folder: Path) -> Comparison:
    """The comparison of a folder whose fields.h5 is there."""
    mpm, dem = ([open_run(path) for path in files] for files in run_files(folder))
    for run in mpm + dem:
        run.mapped = open_fields(folder / "fields.h5", run.name)
    c = pair(mpm, dem)
    c.packings = scatter_of(dem[0]) if len(dem) == 1 else None
    if found := siblings.load(folder):
        c.numerical_uncertainty = siblings.uncertainty(mpm[0], dem[0], found)
    c.no_siblings = siblings.failure(folder)
    return c


def scatter_of(run: Run) -> Packings:
    """The stored scatter of the packings that a run's grains are one of; imported ones only where
    their diameter and density are the case's.
    """
    for name in ("diameter", "density") if run.imported else ():
        own, of_case = run.attributes.get(name), run.case[f"grains.{name}"]
        if name == "diameter":
            of_case = mapped_diameter(run.case["grains"])
        if own is not None and abs(own / of_case - 1.0) > SAME:
            return Packings(
                f"the scatter of the packings is unknown (the grains' {name} is {own:.4g}, the "
                f"case's {of_case:g})"
            )
    return of_run(run)


def margin_of(metric: Metric, run: Run, mean: float) -> float | None:
    """The metric's margin in its own unit, from the case of `run`; None when the case has none for
    it.

    `run` is one of the continuum: grains that are kept for all cases that ask for them may stem
    from one of other margins.
    """
    return margin_in(run.case, metric.margin, mean, run.diameter) if metric.margin else None


def margin_in(scene: Case, key: str, mean: float, diameter: float) -> float:
    """The margin that a case has under a key, for a figure of that `mean`; of grains of `diameter`
    [m].
    """
    share = scene[key]
    grain = diameter / scene["geometry.length"]  # nothing is known to better than a grain
    if key == "compare.margin_run_out":
        return max(share * (1.0 + mean), grain)
    if key == "compare.margin_height":
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


def numerical_loss(run: Run) -> float:
    """Energy that neither is held nor was dissipated at the end, over the energy E0 that the grains
    release; NaN where the run did not audit its energies.
    """
    known = "unaccounted" in run.energy
    return abs(float(run.normalised("unaccounted")[-1])) if known else math.nan


def evaluate_one(metric: Metric, c: Comparison, numerical: float | None = None) -> dict:
    """One entry of metrics.json. `numerical`: what the continuum's numerics may be off by, in the
    metric's unit; it widens the interval that the verdict weighs.
    """
    about = {"unit": metric.unit, "definition": metric.definition, "source": metric.source}
    off, found = numerical or 0.0, None
    if metric.of_pair:
        values = [metric(c.mpm[0], dem) for dem in c.dem]
        entry = {"value": number(float(np.mean(values)))} | spread(values)
        if len(c.dem) > 1:  # what the grains differ by among themselves
            noise = [metric(a, b) for i, a in enumerate(c.dem) for b in c.dem[i + 1 :]]
            entry["noise_floor"] = number(float(np.mean(noise)))
        margin = margin_of(metric, c.mpm[0], 0.0)
        if margin is not None:
            found = verdict.distance(values, margin, off)
    else:
        mpm, dem = [metric(run) for run in c.mpm], [metric(run) for run in c.dem]
        entry = both_sides(mpm, dem)
        stored = c.packings.scatter.get(metric.name) if c.packings and len(dem) == 1 else None
        if stored:
            entry["stored_std"] = number(stored.deviation)
        margin = margin_of(metric, c.mpm[0], float(np.mean(dem)))
        if margin is not None:
            found = verdict.equivalence(mpm, dem, margin, stored, off)
    if numerical is not None:
        entry["numerical_uncertainty"] = number(numerical)
    return entry | (judgement(found, metric, c) if found else {}) | about


def both_sides(mpm: list[float], dem: list[float]) -> dict:
    """Values of a metric of either engine, and how far their means are apart."""
    a, b = float(np.mean(mpm)), float(np.mean(dem))
    entry = {
        "mpm": number(a),
        "dem": number(b),
        "difference": number(a - b),
        "relative_difference": number(a / b - 1.0 if b else math.nan),
    }
    for engine, values in (("mpm", mpm), ("dem", dem)):
        entry |= {f"{engine}_{k}": v for k, v in spread(values).items()}
    return entry


def judgement(v: verdict.Verdict, metric: Metric, c: Comparison) -> dict:
    """What an entry says of a verdict; of an energy, with what the numerics took of it."""
    about = {}
    if metric.margin == "compare.margin_energy":
        losses = [(np.nan_to_num(numerical_loss(run)), run.engine) for run in c.mpm + c.dem]
        loss, engine = max(losses)
        v = v.decided_by(loss)
        if v.word == verdict.UNDECIDABLE:
            side = "continuum's" if engine == "mpm" else "grains'"
            about = {"because": f"{100 * loss:.1f} % lost in the {side} numerics"}
    return {
        "margin": v.margin,
        "half_width": number(v.half_width),
        "verdict": v.word,
        "decides": metric.decides,
    } | about


def evaluate(c: Comparison) -> dict[str, dict]:
    """metrics.json: every metric by name, and the scale of the pairing."""
    out = {
        name: evaluate_one(metric, c, c.numerical_uncertainty.get(name))
        for name, metric in sorted(all_metrics().items())
    }
    out["mass_scale"] = {
        "value": c.mpm[0].mass_scale,
        "unit": "-",
        "source": "pairing",
        "definition": (
            "Factor on the continuum's mass and energies that makes both clouds weigh the same."
        ),
    }
    out["verdict"] = {
        "value": verdict.overall(
            [e["verdict"] for e in out.values() if "verdict" in e and e["decides"]]
        ),
        "unit": "-",
        "source": "equivalence tests against the case's margins",
        "definition": (
            "agree, differ or unresolved where the scatter of the packings is known; within or "
            "outside margin where it is not; not decidable where the numerics took more energy "
            "than the margin."
        ),
        "scatter": scatter_words(c),
    }
    return out


def scatter_words(c: Comparison) -> str:
    """Where the scatter comes from that the verdicts weigh."""
    if len(c.dem) > 1:
        return f"scatter of the {len(c.dem)} packings of this folder"
    return c.packings.words if c.packings else "the scatter of the packings is unknown"
