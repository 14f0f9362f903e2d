"""What laws answer to conditions of a flow: by the program that they are compiled into, mpm_steady.

A law is asked on a lattice of conditions and interpolated between: in steady simple shear at (p,
gdot), and at (p, gdot, T) with the granular temperature held. The lattice is even in the logarithms
of p [Pa], gdot [1/s] and T/(gdot d)^2.
"""

import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, field

import h5py
import numpy as np
from scipy.interpolate import RegularGridInterpolator

from cases import cores
from cases.case import Case, schema
from cases.errors import CaseError, EngineError
from cases.programs import ROOT, call, program
from cases.scratch import temporary
from compare.judge.flow import Cells
from compare.study.recipe import assignment

PER_DECADE = {2: 8, 3: 5}  # nodes of the lattice, by its dimensions
# Over a unit of strain: a law that changes more has no steady state there, such as a gas that
# expands without end because its pressure at that rate is never as low.
UNSTEADY = 1e-3
SPANNING = ("temperature", "dissipation")  # decades: their logarithms are interpolated
ANSWERS = ("friction", "stress_ratio", "void_ratio", "temperature", "dissipation")

EXTERNAL = "external"  # the law of a shared library


@dataclass(frozen=True)
class Candidate:
    """A law with its constants."""

    label: str
    law: str
    card: str
    sets: tuple[str, ...] = ()  # assignments beside those of the card

    @property
    def words(self) -> tuple[str, ...]:
        """What --set tells a case to have it."""
        return (f"material.law={self.law}", f"material.card={self.card}", *self.sets)

    @property
    def constants(self) -> tuple[str, ...]:
        """The same, every key of the material one by one: they hold whatever the case says."""
        path = ROOT / "cases" / "materials" / f"{self.card}.toml"
        values = {
            key: one["default"] for key, one in schema()["material"].items() if "default" in one
        }
        values |= tomllib.loads(path.read_text())["material"] | {"law": self.law, "card": ""}
        return (
            *(assignment(f"material.{key}", value) for key, value in values.items()),
            *self.sets,
        )


def candidates(
    scene: Case, laws: list[str] | None, cards: list[str] | None, also: list[str]
) -> list[Candidate]:
    """Every law with every card, then those of `also`: "LAW:CARD,key=value,…".

    By default every law there is, and every card of cases/materials that is of grains which roll
    like the scene's; a law of a shared library where the scene has one, which reads no card.
    CaseError for a name that is none.
    """
    known_laws = schema()["material"]["law"]["choices"]
    ours = [law for law in known_laws if law != EXTERNAL or scene["material.law"] == EXTERNAL]
    known_cards = sorted(path.stem for path in (ROOT / "cases" / "materials").glob("*.toml"))
    rolls = scene["grains.rolling_friction"] > 0.0
    usual = [card for card in known_cards if of_rolling(card) == rolls] or known_cards
    for asked, known, what in ((laws, known_laws, "law"), (cards, known_cards, "card")):
        for name in asked or []:
            if name not in known:
                raise CaseError(f"{name}: no such {what} (known: {', '.join(known)})")
    found = [
        Candidate(f"{law}, {card}", law, card)
        for law in laws or ours
        for card in ([scene["material.card"]] if law == EXTERNAL else cards or usual)
    ]
    for text in also:
        head, *assignments = text.split(",")
        law, _, card = head.partition(":")
        if law not in known_laws or (card or known_cards[0]) not in known_cards:
            raise CaseError(
                f"--also {text}: '{head}' (not LAW:CARD; laws: {', '.join(known_laws)}; cards: "
                f"{', '.join(known_cards)})"
            )
        card = card or scene["material.card"]
        changed = [word.removeprefix("material.") for word in assignments]
        found.append(Candidate(", ".join([law, card, *changed]), law, card, tuple(assignments)))
    return found


def of_rolling(card: str) -> bool:
    """Whether a card is of grains that resist rolling."""
    told = tomllib.loads((ROOT / "cases" / "materials" / f"{card}.toml").read_text())
    return told.get("grains", {}).get("rolling_friction", 0.0) > 0.0


@dataclass
class Lattice:
    """Nodes of a grid, `spacing` apart in each logarithm, and the answers at those in use."""

    axes: list[np.ndarray]  # logarithms
    used: np.ndarray  # bool, a value per node
    answers: dict[str, np.ndarray] = field(default_factory=dict)

    @classmethod
    def around(cls, logs: np.ndarray) -> "Lattice":
        """Holds the points `logs` (n, dimensions) between its nodes."""
        step = np.log(10.0) / PER_DECADE[logs.shape[1]]
        low = np.floor(logs.min(axis=0) / step).astype(int)
        count = np.floor(logs.max(axis=0) / step).astype(int) - low + 2
        used = np.zeros(count, dtype=bool)
        corner = np.floor(logs / step).astype(int) - low
        for offset in np.ndindex(*[2] * logs.shape[1]):
            used[tuple((corner + offset).T)] = True
        return cls([step * (a + np.arange(n)) for a, n in zip(low, count)], used)

    def nodes(self) -> np.ndarray:
        """(n, dimensions) of the nodes in use."""
        grids = np.meshgrid(*self.axes, indexing="ij")
        return np.stack([one[self.used] for one in grids], axis=-1)

    def keep(self, answers: dict[str, np.ndarray]) -> None:
        with np.errstate(divide="ignore"):  # a law without a granular temperature has none
            for name, values in answers.items():
                whole = np.full(self.used.shape, np.nan)
                whole[self.used] = np.log(values) if name in SPANNING else values
                self.answers[name] = whole

    def at(self, logs: np.ndarray, names: Iterable[str] = ()) -> dict[str, np.ndarray]:
        """Those of the answers, or all, between the nodes."""
        found = {
            name: RegularGridInterpolator(self.axes, self.answers[name])(logs)
            for name in names or self.answers
        }
        return {name: np.exp(one) if name in SPANNING else one for name, one in found.items()}


def logs(cells: Cells, diameter: float, held: bool) -> np.ndarray:
    """Conditions of cells as a Lattice has them, (n, 2), or (n, 3) with the temperature `held`."""
    columns = [np.log(cells.pressure), np.log(cells.shear_rate)]
    if held:
        columns.append(np.log(cells.temperature / (cells.shear_rate * diameter) ** 2))
    return np.stack(columns, axis=-1)


class Answers:
    """What one candidate answers to the conditions of many cells."""

    def __init__(self, scene: Case, candidate: Candidate, cells: list[Cells]):
        """Asks the law once for all `cells`. EngineError where it cannot be driven."""
        self.scene, self.candidate = scene, candidate
        self.also: list[Candidate] = []  # candidates that answer the same
        self.diameter = scene["grains.diameter"]
        self.steady = self.ask(np.concatenate([logs(one, self.diameter, False) for one in cells]))
        warm = [one.where(one.temperature > 0.0) for one in cells]
        self.held: Lattice | None = None
        if self.fluctuates and any(len(one) for one in warm):
            points = np.concatenate([logs(one, self.diameter, True) for one in warm])
            self.held = self.ask(points)

    @property
    def label(self) -> str:
        """The law, with the cards that make no difference left out."""
        if not self.also:
            return self.candidate.label
        if {one.law for one in self.also} == {self.candidate.law}:
            return self.candidate.law
        return " = ".join(one.label for one in (self.candidate, *self.also))

    def equals(self, other: "Answers") -> bool:
        """Whether another answers the same everywhere; both were asked alike."""
        return all(
            np.array_equal(values, other.steady.answers[name], equal_nan=True)
            for name, values in self.steady.answers.items()
        )

    @property
    def dilates(self) -> bool:
        """Whether its void ratio depends on the conditions."""
        e = self.steady.answers["void_ratio"]
        return bool(np.nanmax(e) > np.nanmin(e) * (1.0 + 1e-6))

    @property
    def fluctuates(self) -> bool:
        """Whether the law knows a granular temperature."""
        return bool(np.any(self.steady.answers["temperature"] > -np.inf))

    @property
    def unsteady(self) -> float:
        """Share of the lattice at which the law has no steady shear."""
        friction = self.steady.answers["friction"][self.steady.used]
        return float(np.mean(~np.isfinite(friction)))

    def ask(self, points: np.ndarray) -> Lattice:
        lattice = Lattice.around(points)
        nodes = lattice.nodes()
        conditions = {"pressure": np.exp(nodes[:, 0]), "shear_rate": np.exp(nodes[:, 1])}
        if nodes.shape[1] == 3:
            sheared = (conditions["shear_rate"] * self.diameter) ** 2
            conditions["granular_temperature"] = np.exp(nodes[:, 2]) * sheared
        lattice.keep(steady_shear(self.scene, self.candidate.constants, conditions))
        return lattice

    def to(
        self, cells: Cells, held: bool = False, names: Iterable[str] = ANSWERS
    ) -> dict[str, np.ndarray]:
        """Answers at the cells' (p, gdot), or at their (p, gdot, T); NaN where there is none."""
        if not held:
            return self.steady.at(logs(cells, self.diameter, False), names)
        warm = cells.temperature > 0.0
        answers = {name: np.full(len(cells), np.nan) for name in names}
        if self.held is not None and warm.any():
            found = self.held.at(logs(cells.where(warm), self.diameter, True), names)
            for name, values in found.items():
                answers[name][warm] = values
        return answers


def steady_shear(
    scene: Case, words: tuple[str, ...], conditions: dict[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """ANSWERS of a law, the case's with `words` set, to `conditions` (each (n,): pressure,
    shear_rate, perhaps granular_temperature); NaN where it has no steady state. Its grains are as
    stiff as those of the case that the engine of the grains computes.
    """
    softness = scene["dem.young_modulus"] or scene["grains.young_modulus"]
    sets = [f"mpm.young_modulus={float(softness)!r}", *words]
    with temporary() as folder:
        given, out = folder / "conditions.h5", folder / "answers.h5"
        case = folder / "case.toml"
        case.write_text(scene.resolved)
        with h5py.File(given, "w") as file:
            for name, values in conditions.items():
                file[name] = values
        asked = [word for assignment in sets for word in ("--set", assignment)]
        command = [program("mpm_steady"), case, "--conditions", given, "-o", out, *asked]
        done = call([*command, "--threads", cores.usable()])
        if done.returncode:
            raise (CaseError if done.returncode == 2 else EngineError)(done.stderr.strip())
        with h5py.File(out) as file:
            found = {name: values[:] for name, values in file.items()}
    p = found["pressure"]
    steady = found["change"] <= UNSTEADY
    answers = {
        "friction": found["shear_stress"] / p,
        "stress_ratio": found["deviatoric_stress"] / p,
        "void_ratio": found["void_ratio"],
        "temperature": found["granular_temperature"],
        "dissipation": found["dissipation"],
    }
    return {name: np.where(steady, values, np.nan) for name, values in answers.items()}
