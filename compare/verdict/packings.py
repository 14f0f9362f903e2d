"""The scatter between packings that a case ships, for verdicts on a single pair.

cases/<case>/reference/ensemble_metrics.csv holds the metrics of an ensemble's packings, one row
each (compare/study/packings.py makes it); its head says what they were made of. It is taken by
these inputs, never by a name: a table of other grains says nothing of these.
"""

import json
import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from cases.errors import CaseError
from cases.programs import ROOT, short
from compare.mapping.runs import Run
from compare.verdict.equivalence import Scatter
from dem_reference.content import completed, differences, inputs

TABLE = Path("reference") / "ensemble_metrics.csv"
MADE_OF = "# made of: "


@dataclass(frozen=True)
class Packings:
    """`words` say which packings the scatter is of, or in one line why there is none."""

    words: str
    scatter: dict[str, Scatter] = field(default_factory=dict)  # by metric
    source: str = ""


def of_run(run: Run, cases: Path = ROOT / "cases") -> Packings:
    """The stored scatter of the packings that a run of the grains is one of."""
    asked, nearest = inputs(run.case), None
    for path in tables(run, cases):
        made_of = completed(stated(path))
        others = differences(made_of, asked)
        if not others:
            return read(path)
        if nearest is None or len(others) < nearest[0]:
            key = others[0]
            told = f"{short(path)} has {key} = {made_of.get(key)}, not {asked.get(key)}"
            more = f", and {len(others) - 1} more inputs differ" if len(others) > 1 else ""
            nearest = (len(others), told + more)
    why = nearest[1] if nearest else "no table of packings is stored"
    return Packings(f"the scatter of the packings is unknown ({why})")


def tables(run: Run, cases: Path) -> Iterator[Path]:
    """Tables of packings: that of the case which the run's command names, then those of the
    project.
    """
    found = []
    for word in shlex.split(str(run.attributes.get("command", ""))):
        folder = Path(word) if Path(word).is_dir() else Path(word).parent
        found.append(folder / TABLE)
    for path in dict.fromkeys(p.resolve() for p in [*found, *sorted(cases.glob(f"*/{TABLE}"))]):
        if path.is_file() and stated(path):
            yield path


def stated(path: Path) -> dict:
    """The inputs that a table says its packings were made of; empty where it says nothing."""
    with refusing(path), path.open(encoding="utf-8") as file:
        for line in file:
            if line.startswith(MADE_OF):
                return dict(json.loads(line.removeprefix(MADE_OF)))
            if not line.startswith("#"):
                break
    return {}


@contextmanager
def refusing(path: Path) -> Iterator[None]:
    """Tells what a table that somebody broke raises in the block: CaseError."""
    try:
        yield
    except (OSError, TypeError, ValueError, RecursionError) as error:  # pandas' own are of these
        why = " ".join(str(error).split())
        raise CaseError(
            f"{path}: not a table of packings ({why}) make it anew or move it"
        ) from None


def read(path: Path) -> Packings:
    with refusing(path):
        table = pd.read_csv(path, comment="#").drop(columns="seed", errors="ignore").astype(float)
    scatter = {
        str(name): Scatter(float(values.std(ddof=1)), len(values))
        for name, values in table.items()
        if len(values) > 1 and np.isfinite(values).all()
    }
    where = str(short(path))
    return Packings(f"scatter of the {len(table)} packings of {where}", scatter, where)
