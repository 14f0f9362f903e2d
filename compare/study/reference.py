"""What the grains say of a scene: the mean of an ensemble, and how far its members are from one
another.
"""

import json
from pathlib import Path

import numpy as np

from cases import case, command_line, provenance, workflow
from cases.errors import CaseError
from cases.files import write_atomically
from cases.reading import UNEXPECTED
from compare.mapping.runs import open_run
from compare.study.measure import COLLAPSE, Measure
from dem_reference import ensemble
from dem_reference.content import completed, differences, ensemble_folder, inputs


def arguments(parser):
    parser.add_argument(
        "--ensemble", type=Path, metavar="DIR", help="folder of the grains' runs <seed>.h5"
    )
    parser.add_argument(
        "--reference",
        type=Path,
        metavar="FILE",
        help="the grains' mean as an earlier study wrote it (grains.json)",
    )
    parser.add_argument(
        "--seeds",
        type=command_line.several,
        metavar="N",
        help="make an ensemble of N seeds, or what is missing of it (dem_reference.ensemble). "
        "Without these three: that ensemble if it is there, else "
        "cases/<case>/reference/grains.json, else 8 seeds",
    )


def obtain(scene: case.Case, options, by: Measure = COLLAPSE) -> dict:
    """The reference that the options name.

    {"about", "made_of": inputs that decide grains, "members": [signature...], "mean": signature,
    "scatter": {metric: [errors]}, ...}. Raises CaseError where it is of other grains than the
    scene's.
    """
    if options.reference:
        return read(options.reference, scene, by)
    if options.ensemble:
        files = runs_in(options.ensemble)
        if not files:
            raise CaseError(f"{options.ensemble}: no run <seed>.h5 in it")
        return of_runs(files, scene, by)
    files = runs_in(ensemble_folder(scene))
    committed = scene.path.parent / "reference" / "grains.json"
    if not files and not options.seeds and committed.exists():
        return read(committed, scene, by)
    if options.seeds or not files:
        where = workflow.Where(options.jobs, options.profile)
        seeds = range(1, (options.seeds or 8) + 1)
        ensemble.make(scene, [], seeds, where, quiet=options.quiet)
    return of_runs(runs_in(ensemble_folder(scene)), scene, by)


def runs_in(folder: Path) -> list[Path]:
    """The runs <seed>.h5 of a folder, by seed."""
    return sorted(folder.glob("[0-9]*.h5"), key=lambda path: int(path.stem))


def read(path: Path, scene: case.Case, by: Measure = COLLAPSE) -> dict:
    """A reference as write(…) wrote it; raises CaseError where it does not say that it is of the
    scene's grains.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise CaseError(f"{path}: not a reference of the grains ({error})") from error
    made_of = found.get("made_of") if isinstance(found, dict) else None
    if not isinstance(made_of, dict):
        raise CaseError(
            f"{path}: not a reference of the grains (it does not state what it was made of) "
            "make it again from its runs, with --ensemble DIR"
        )
    refuse_others(path, made_of, scene)
    # of the members, as they are judged now: an error may have been another figure when it was kept
    try:
        with np.errstate(invalid="raise"):
            return found | {"scatter": scatter(found["members"], scene, by)}
    except (*UNEXPECTED, ArithmeticError) as error:
        why = f"of its members: {type(error).__name__}, {error}"
        raise CaseError(
            f"{path}: not a reference of the grains ({why}) make it again from its runs, with "
            "--ensemble DIR"
        ) from error


def refuse_others(path: Path, made_of: dict, scene: case.Case):
    """Raises CaseError where grains made of other inputs than the scene's are taken for its own."""
    asked = inputs(scene)
    made_of = completed(made_of)
    others = differences(made_of, asked)
    if others:
        told = [f"{key} = {made_of.get(key)}, not {asked.get(key)}" for key in others]
        raise CaseError(
            f"{path}: {'; '.join(told)} (other grains than those of {scene.path}) "
            f"make them with: python3 -m dem_reference.ensemble {scene.path.parent} --seeds 8"
        )


def of_runs(files: list[Path], scene: case.Case, by: Measure = COLLAPSE) -> dict:
    """The reference of an ensemble's files. Each member is held against the mean of the others."""
    if len(files) < 2:
        raise CaseError(
            f"{files[0].parent if files else scene.path}: {len(files)} run of the grains "
            "(two at least show a scatter)"
        )
    runs = [open_run(file) for file in files]
    for file, run in zip(files, runs):
        refuse_others(file, inputs(run.case), scene)
    seeds = [by.signature(file) for file in files]
    origin = {"command": runs[0].attributes["command"], "commit": runs[0].attributes["commit"]}
    return {
        "about": provenance.about("") | origin,
        "made_of": inputs(scene),
        "members": seeds,
        "mean": by.mean(seeds, scene),
        "scatter": scatter(seeds, scene, by),
        "duration": float(np.mean([seed["tau"][-1] for seed in seeds])),
        "seeds": [seed["seed"] for seed in seeds],
        "spread": by.spread(seeds, scene),
    }


def scatter(seeds: list[dict], scene: case.Case, by: Measure = COLLAPSE) -> dict[str, list[float]]:
    """Errors of each seed, by name, from the mean of the others."""
    left_out = [
        by.errors(seed, by.mean([one for one in seeds if one is not seed], scene), scene)
        for seed in seeds
    ]
    return {name: [one[name] for one in left_out] for name in left_out[0]}


def unknown(reference: dict, name: str, by: Measure = COLLAPSE) -> str:
    """Why an error cannot be told from a reference; "" where it can."""
    if not np.isnan(reference["scatter"][name]).all():
        return ""
    state = reference.get("mean", {}).get("state", "steady")
    if state != "steady":
        return (
            f"{by.words[name]}: not known (the grains have no steady flow: {state}) give them "
            "another inclination or a longer time.maximum"
        )
    return (
        f"{by.words[name]}: not known (these grains were kept without what it is told from) make "
        "them again, with --seeds 8"
    )


def write(reference: dict, path: Path, by: Measure = COLLAPSE):
    """As JSON, which has no NaN: scatters that are unknown are left out."""
    known = {
        name: values
        for name, values in reference["scatter"].items()
        if not unknown(reference, name, by)
    }
    write_atomically(path, json.dumps(reference | {"scatter": known}) + "\n")
