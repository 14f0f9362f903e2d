"""What spoils a comparison, or must be known to read it: one file per check, which registers
itself.

A check is a function of a Comparison and its metrics that yields findings: one for each trouble it
sees, none where all is well. Its docstring says what it looks at. Severities: `note`, to be known;
`caution`, the verdict weighs less; `invalid`, the result is none, whatever the verdict says.
"""

import importlib
import pkgutil
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from enum import StrEnum

from compare.mapping.runs import Run

SIDE = {"mpm": "continuum", "dem": "grains"}


class Severity(StrEnum):
    INVALID = "invalid"
    CAUTION = "caution"
    NOTE = "note"


@dataclass(frozen=True)
class Finding:
    """`sentence` says what is wrong, `advice` what to do; `figure` was measured, `bound` is what it
    is held against, for the `reason`.
    """

    severity: Severity
    sentence: str
    advice: str
    figure: float | None = None
    bound: float | None = None
    unit: str = "-"
    reason: str = ""
    of: str = "pair"  # "mpm", "dem" or "pair"
    name: str = ""  # the check's


@dataclass(frozen=True)
class Check:
    name: str
    definition: str
    order: int
    function: Callable

    def __call__(self, c, metrics: dict) -> list[Finding]:
        return [replace(found, name=self.name) for found in self.function(c, metrics)]


REGISTRY: dict[str, Check] = {}


def check(*, order: int):
    """Registers a function of (comparison, metrics) that yields findings, under its own name."""

    def register(function: Callable[..., Iterable[Finding]]):
        definition = " ".join((function.__doc__ or "").split())
        REGISTRY[function.__name__] = Check(function.__name__, definition, order, function)
        return function

    return register


def all_checks() -> list[Check]:
    for module in pkgutil.iter_modules(__path__):
        importlib.import_module(f"{__name__}.{module.name}")
    return sorted(REGISTRY.values(), key=lambda one: one.order)


def findings(c, metrics: dict) -> list[Finding]:
    """Every finding of a comparison, the worst first."""
    found = [one for check in all_checks() for one in check(c, metrics)]
    return sorted(found, key=lambda one: list(Severity).index(one.severity))


def entry(found: list[Finding]) -> dict:
    """As metrics.json shows them: the worst severity, and the list."""
    return {
        "value": found[0].severity if found else "none",
        "unit": "-",
        "source": "checks of the runs and of the pair",
        "definition": "The worst of what spoils the result: invalid, caution, note or none.",
        "list": [asdict(one) for one in found],
    }


def sides(c) -> list[tuple[str, Sequence[Run]]]:
    """The runs of either engine."""
    return [(engine, runs) for engine, runs in (("mpm", c.mpm), ("dem", c.dem)) if runs]


def worst(runs: Sequence[Run], figure: Callable[[Run], float]) -> tuple[float, str]:
    """The largest figure of the runs, and where there are several, which run has it."""
    value, name = max((figure(run), run.name) for run in runs)
    return value, f" ({name}.h5, the worst of {len(runs)})" if len(runs) > 1 else ""
