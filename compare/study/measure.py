"""What runs of one kind of scene are told apart by, so that a study need not know the kind."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cases.case import Case
from cases.errors import CaseError
from cases.scratch import temporary
from compare.mapping.runs import map_fields, open_fields, open_run
from compare.metrics import all_metrics
from compare.study import distance
from compare.study.signature import compact, expand
from compare.verdict.comparison import pair


@dataclass(frozen=True)
class Measure:
    """words: of each error, by name; usual: the error that is judged unless another is asked for;
    point: the module that makes a point of a recipe (compare/study/point.py); signature: of a
    result file; mean: of signatures; errors: of a signature from a mean, by name, NaN where it is
    not known; spread: the scalars of signatures.
    """

    words: dict[str, str]
    usual: str
    point: str
    signature: Callable[[Path], dict]
    mean: Callable[[list[dict], Case], dict]
    errors: Callable[[dict, dict, Case], dict[str, float]]
    spread: Callable[[list[dict], Case], dict[str, dict]]

    def asked(self, metric: str | None) -> str:
        """The error to be judged. Raises CaseError for one that these scenes do not have."""
        if metric is not None and metric not in self.words:
            raise CaseError(
                f"--metric {metric}: no error of this kind of scene (it has "
                f"{', '.join(self.words)}) choose one of these"
            )
        return metric or self.usual


def mapped(file: Path) -> dict:
    """The signature of a result file with its fields."""
    run = open_run(file)
    with temporary() as folder:
        fields = folder / "fields.h5"
        map_fields([file], fields)
        run.mapped = open_fields(fields, run.name)
        return compact(run)


def spread(seeds: list[dict], scene: Case) -> dict[str, dict]:
    """Values of the scalar metrics over the seeds."""
    runs = [expand(seed, scene) for seed in seeds]
    pair([], runs)
    names = ("run_out_95", "run_out", "run_out_99", "dissipated_energy", "kinetic_energy_peak")
    return scattered({name: [float(all_metrics()[name](run)) for run in runs] for name in names})


def scattered(values: dict[str, list[float]]) -> dict[str, dict]:
    """Mean and standard deviation beside the values of each name."""
    return {
        name: {"mean": float(np.mean(v)), "std": float(np.std(v, ddof=1)), "values": v}
        for name, v in values.items()
    }


COLLAPSE = Measure(
    distance.WORDS,
    "deposit",
    "compare.study.point",
    mapped,
    distance.mean,
    distance.errors,
    spread,
)
