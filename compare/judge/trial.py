"""A trial of laws: the cells of every packing and width, each law's answers, and what is refused.

Negative controls stand beside the laws: one with its friction doubled, and the flow with its fields
shuffled, which must be refused.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from cases.case import Case
from cases.errors import CaseError
from cases.scenes import is_chute
from cases.scratch import temporary
from compare.judge import bias, density, flow, steady
from compare.judge.flow import ZONES, Cells
from compare.judge.laws import Answers, Candidate
from compare.mapping.runs import map_fields, open_fields, open_run

# cos(s, D) below which a width is refused: a third of what moves is noise of single grains.
COAXIAL = 2.0 / 3.0
LOST = 0.5  # share of the lattice without a steady shear from which a law is not judged
Tell = Callable[[float, str], None]


@dataclass
class Trial:
    scene: Case
    engine: str  # dem, or mpm for what a run of the continuum visits
    files: list[Path]
    runs: list[list[Cells]]  # of every file the cells of each accepted width
    laws: list[Answers] = field(default_factory=list)
    table: pd.DataFrame = field(default_factory=pd.DataFrame)
    refused: list[str] = field(default_factory=list)  # what, and why


def mapped(files: list[Path], widths: Iterable[float], tell: Tell) -> tuple[list, list[str]]:
    """Cells of every file and accepted width, and what was refused. CaseError if all widths are."""
    runs: list[list[Cells]] = [[] for _ in files]
    refused = []
    widths = sorted(widths)
    for file in files:
        flow.refuse_without_stress(file)
    with temporary() as folder:
        for i, width in enumerate(widths):
            tell(i / len(widths), f"mapping with a width of {width:g} d")
            found = cells_of(files, width, folder / f"{width}.h5")
            cos = [one.coaxiality() for one in found]
            if not min(cos) >= COAXIAL:
                refused.append(
                    f"width {width:g} d: cos(s, D) = {min(cos):.2f} in what flows, below "
                    f"{COAXIAL:.2f} (the strain rate is noise of single grains)"
                )
                continue
            for one, cells in zip(runs, found):
                one.append(cells)
    if not runs[0]:
        raise CaseError(f"{files[0]}: {'; '.join(refused)} give wider ones with --widths")
    return runs, refused


def cells_of(files: list[Path], width: float, path: Path) -> list[Cells]:
    """Cells of every file, mapped with a width [d] into the file `path`."""
    runs = [open_run(file) for file in files]
    if is_chute(runs[0].case["geometry"]):
        return [flow.cells(steady.profile(file, width)) for file in files]
    map_fields(files, path, "--width", str(width), "--spacing", str(width / 1.5))
    for run in runs:
        run.mapped = open_fields(path, run.name)
    return [flow.cells(run) for run in runs]


def judge(
    scene: Case,
    files: list[Path],
    candidates: list[Candidate],
    widths: Iterable[float],
    tell: Tell = lambda fraction, text: None,
) -> Trial:
    """Asks every candidate for its answer to the flow of the runs `files`."""
    runs, refused = mapped(files, widths, lambda share, text: tell(0.6 * share, text))
    engine = open_run(files[0]).engine
    moving = [[cells.where(cells.zone > 0) for cells in one] for one in runs]
    trial = Trial(scene, engine, files, moving, refused=refused)
    rows: list[dict] = []
    for i, candidate in enumerate(candidates):
        tell(0.6 + 0.4 * i / len(candidates), f"asking {candidate.label}")
        answers = Answers(scene, candidate, [cells for one in moving for cells in one])
        if answers.unsteady > LOST:
            trial.refused.append(
                f"{candidate.label}: no steady shear at {100 * answers.unsteady:.0f} % of the "
                "conditions (an elastic law never yields)"
            )
            continue
        if twin := next((one for one in trial.laws if one.equals(answers)), None):
            twin.also.append(candidate)
            continue
        trial.laws.append(answers)
    for answers in trial.laws:
        rows += bias.rows(answers, moving)
        found, why = density.rows(answers, moving)
        rows += found
        trial.refused += why
    if not trial.laws:
        raise CaseError(f"{scene.path}: {'; '.join(trial.refused)}")
    trial.table = pd.DataFrame(rows)
    trial.refused.append(
        f"void ratio as a condition: {density.WHY}; cells at rest (γ̇√(H/g) < {flow.STATIC:g}), "
        "nearer to the free surface than the kernel's width, or almost without pressure"
    )
    return trial


def overall(trial: Trial) -> pd.DataFrame:
    """One line per law: its bias in all that flows, and by zone, with the ranges over packings and
    widths; the nearest to the grains first.
    """
    lines = []
    for answers in trial.laws:
        label = answers.label
        line: dict[str, object] = {"law": label}
        mine = trial.table[trial.table.law == label]

        def told(quantity, given="p, γ̇", place=bias.OVERALL, mine=mine):
            found = mine[
                (mine.quantity == quantity) & (mine.given == given) & (mine.place == place)
            ]
            return found.iloc[0] if len(found) else None

        friction = told("friction")
        line |= {
            "bias of μ_D": friction.ratio - 1.0,
            "from": friction.low - 1.0,
            "to": friction.high - 1.0,
        }
        for zone in ZONES[1:5]:
            line[f"μ_D {zone}"] = told("friction", place=zone).ratio - 1.0
        for name, given, word in (
            ("temperature", "p, γ̇", "T ratio"),
            ("dissipation", "p, γ̇, T", "Γ ratio at T"),
            ("friction", "p, γ̇, T", "μ_D ratio at T"),
            ("void_ratio", "p, γ̇", "e difference"),
        ):
            found = told(name, given)
            line[word] = float("nan") if found is None else found.ratio
        lines.append(line)
    return pd.DataFrame(lines).sort_values("bias of μ_D", key=abs).reset_index(drop=True)


@dataclass(frozen=True)
class Control:
    name: str
    rejected: bool
    words: str


def controls(trial: Trial) -> list[Control]:
    """What must be told apart: the nearest law with its friction doubled, and shuffled fields."""
    best = overall(trial).iloc[0]
    low, high = (2.0 * (1.0 + best[name]) - 1.0 for name in ("from", "to"))
    cos = max(abs(flow.shuffled(cells).coaxiality()) for one in trial.runs for cells in one)
    return [
        Control(
            "friction doubled",
            bool(low > max(best["to"], 0.0)),
            f"{best.law} with its friction doubled: {low:+.0%} … {high:+.0%}, apart from "
            f"{best['from']:+.0%} … {best['to']:+.0%}",
        ),
        Control(
            "fields shuffled",
            bool(cos < COAXIAL),
            f"every cell with the stress of another: cos(s, D) = {cos:.2f}, refused below "
            f"{COAXIAL:.2f}",
        ),
    ]
