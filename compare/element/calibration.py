"""Fits a material card to the DEM element tests, and to nothing else: never to a column.

Every measured quantity is compared through its logarithm (the void ratio itself in triaxial compression). Its weight is
1/(s^2 + f^2): s the standard error over seeds, f a floor of MODEL_ERROR, because the law is a model and one well-measured
point must not outvote the others. A soft-L1 loss keeps what the law cannot follow from bending the rest.
"""
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from compare.element.model import EXPONENT, Card, Model
from cases.errors import CaseError
from dem_reference.element import campaign, records
from dem_reference.element.case import Case
from dem_reference.element.grains import Grains

TESTS = ("shear", "cooling", "triaxial", "isotropic")
MODEL_ERROR = 0.05  # relative; on void ratio MODEL_ERROR x 0.1
DILUTE = 0.4  # solid fraction up to which g0 is Carnahan and Starling's, with friction or without
STEADY = 0.75  # fraction of the axial strain after which a triaxial test is taken as critical
CURVE = 8  # points of a triaxial curve that are compared
# What is fitted, and the interval it may take: (name, lower, upper, fitted through its logarithm). Below delta = 0.05 the
# dilatancy is at its bound whenever it is not zero, so a smaller delta says nothing more.
PARAMETERS = (
    ("critical_void_ratio", 0.60, 0.85, False),
    ("critical_state_slope", 1e-3, 50.0, True),
    ("stress_ratio", 0.3, 1.5, False),
    ("bulk_stiffness", 5.0, 2000.0, True),
    ("shear_stiffness", 5.0, 2000.0, True),
    ("stiffness_exponent", 0.0, 0.9, False),
    ("dilatancy", 0.05, 5.0, True),
    ("effective_restitution", 0.2, 0.95, False),
    ("collision_time_factor", 0.05, 50.0, True),
    ("correlation_factor", 0.02, 50.0, True),
)
NAMES = tuple(name for name, *_ in PARAMETERS)


@dataclass(frozen=True)
class Block:
    """Observations of one kind: measured values with standard errors over seeds, and the law's answer to them."""

    kind: str  # e.g. "shear pressure"
    labels: list[str]
    measured: np.ndarray
    error: np.ndarray  # standard error over seeds
    floor: float
    predict: Callable[[Model], np.ndarray]
    curve: int = (
        1  # so many observations are points of one curve, too correlated to count as more than one
    )

    @property
    def sigma(self) -> np.ndarray:
        return np.hypot(self.error, self.floor) * np.sqrt(self.curve)


@dataclass(frozen=True)
class Fit:
    card: Card
    standard_error: dict  # by parameter, from the covariance scaled by the reduced chi-square
    bootstrap: dict  # by parameter, standard deviation over fits to resampled seeds
    chi_square: float
    observations: int
    at_bound: list[
        str
    ]  # parameters that ended on the edge of their interval: not determined by the data


def evidence(cases: Path, choose=lambda rows: rows) -> tuple[list[Block], Grains]:
    """The blocks of all element tests under `cases`. `choose` picks the runs used of each point: a list of seeds -> a list."""
    blocks, grains = [], None
    for test in TESTS:
        case = Case(cases / test)
        rows = [
            row
            for row in records.read(campaign.reference_file(case))
            if row["status"] == "measured"
        ]
        if not rows:
            raise CaseError(
                f"{campaign.reference_file(case)}: no measured point. Run: grainpair element cases/{test}"
            )
        if grains not in (None, case.grains):
            raise CaseError(
                f"{case.path}: its grains differ from the other tests' (a card belongs to one kind of grain)"
            )
        grains = case.grains
        if (
            test == "cooling"
        ):  # denser, the law's contact value is that of sheared grains, which a cooling gas does not have
            rows = [row for row in rows if row["friction"] > 0 and row["solid_fraction"] <= DILUTE]
        blocks += globals()[f"{test}_blocks"](rows, choose)
    return blocks, grains


def by_point(rows: list[dict], keys: tuple, choose) -> dict:
    """Rows grouped by the values of `keys`, the seeds of each group as `choose` picks them: {point: [[rows of a seed]]}."""
    groups = defaultdict(lambda: defaultdict(list))
    for row in rows:
        groups[tuple(row[key] for key in keys)][row["seed"]].append(row)
    return {point: choose(list(seeds.values())) for point, seeds in sorted(groups.items())}


def mean_and_error(
    values: np.ndarray, least: np.ndarray | float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Mean over seeds (first axis) and its standard error, not below `least`; one seed alone has the error `least`."""
    values = np.asarray(values, dtype=float)
    error = (
        values.std(axis=0, ddof=1) / np.sqrt(len(values))
        if len(values) > 1
        else np.zeros(values.shape[1:])
    )
    return values.mean(axis=0), np.maximum(error, least)


def shear_blocks(rows, choose) -> list[Block]:
    points = by_point(rows, ("solid_fraction", "shear_rate"), choose)
    nu, rate = np.array(list(points)).T
    blocks = []
    for name in ("granular_temperature", "pressure", "shear_stress"):
        pairs = [
            mean_and_error(
                [np.log(seed[0][name]) for seed in seeds],
                np.mean([seed[0][f"{name}_error"] / seed[0][name] for seed in seeds])
                / np.sqrt(len(seeds)),
            )
            for seeds in points.values()
        ]
        measured, error = np.array(pairs).T
        blocks.append(
            Block(
                f"shear {name}",
                [f"nu {a:g}, {b:g} /s" for a, b in points],
                measured,
                error,
                MODEL_ERROR,
                lambda model, name=name: np.log(model.shear(nu, rate)[name]),
            )
        )
    return blocks


def haff_slope(rows: list[dict]) -> float:
    """ln of d(T^-1/2)/dt over the second half of a cooling curve, when the spins have come to their share."""
    time = np.array([row["time"] for row in rows])
    inverse = np.array([row["temperature"] for row in rows]) ** -0.5
    late = slice(len(rows) // 2, None)
    return float(np.log(np.polyfit(time[late], inverse[late], 1)[0]))


def cooling_blocks(rows, choose) -> list[Block]:
    """With friction the card's effective restitution is judged, without it plain kinetic theory."""
    blocks = []
    for kind, chosen, law in (
        ("cooling rate", [row for row in rows if row["friction"] > 0], lambda model: model),
        (
            "frictionless cooling rate",
            [row for row in rows if row["friction"] == 0],
            Model.frictionless,
        ),
    ):
        if not chosen:
            continue
        points = by_point(chosen, ("solid_fraction",), choose)
        nu = np.array([point[0] for point in points])
        measured, error = np.array(
            [
                mean_and_error([haff_slope(seed) for seed in seeds], 0.02)
                for seeds in points.values()
            ]
        ).T
        ends = np.array(
            [
                [
                    np.mean([seed[at]["temperature"] for seed in seeds])
                    for at in (len(seeds[0]) // 2, -1)
                ]
                for seeds in points.values()
            ]
        ).T

        def predict(model: Model, nu=nu, ends=ends, law=law) -> np.ndarray:
            first, last = (law(model).cooling_time(nu, 1.0, T) for T in ends)
            return np.log((ends[1] ** -0.5 - ends[0] ** -0.5) / (last - first))

        blocks.append(Block(kind, [f"nu {x:g}" for x in nu], measured, error, MODEL_ERROR, predict))
    return blocks


def triaxial_blocks(rows, choose) -> list[Block]:
    points = by_point(rows, ("pressure", "preparation_friction"), choose)
    labels = [f"{p / 1e3:g} kPa, prepared with mu {mu:g}" for p, mu in points]
    ratios, curves, starts, strains, ends = [], [], [], [], []
    for seeds in points.values():
        strain = np.array([row["axial_strain"] for row in seeds[0]])
        steady = strain > STEADY * strain[-1]
        axial, lateral, void_ratio = (
            np.array([[row[name] for row in seed] for seed in seeds])
            for name in ("axial_stress", "lateral_stress", "void_ratio")
        )
        ratio = (axial - lateral) / (axial + 2 * lateral) * 3
        ratios.append(mean_and_error(np.log(ratio[:, steady].mean(axis=1)), 0.01))
        picked = np.linspace(0, len(strain) - 1, CURVE + 1).round().astype(int)[1:]
        curves.append(mean_and_error(void_ratio[:, picked], 0.001))
        starts.append(void_ratio[:, 0].mean())
        strains.append(strain[picked])
        ends.append(strain[steady])
    pressures = np.array([p for p, _ in points])
    steady_ratio, steady_error = np.array(ratios).T

    def curve(model: Model) -> np.ndarray:
        return np.concatenate(
            [
                model.triaxial(e, p, strain)["void_ratio"]
                for e, p, strain in zip(starts, pressures, strains)
            ]
        )

    def ratio_at_end(model: Model) -> np.ndarray:
        answers = [model.triaxial(e, p, strain) for e, p, strain in zip(starts, pressures, ends)]
        return np.log([np.mean(answer["deviator"] / answer["pressure"]) for answer in answers])

    return [
        Block(
            "triaxial stress ratio", labels, steady_ratio, steady_error, MODEL_ERROR, ratio_at_end
        ),
        Block(
            "triaxial void ratio",
            [f"{label}, strain {x:.2f}" for label, xs in zip(labels, strains) for x in xs],
            np.concatenate([c[0] for c in curves]),
            np.concatenate([c[1] for c in curves]),
            0.1 * MODEL_ERROR,
            curve,
            CURVE,
        ),
    ]


def isotropic_blocks(rows, choose) -> list[Block]:
    points = by_point(rows, ("preparation_friction",), choose)
    blocks = []
    for index, name in enumerate(("bulk_modulus", "shear_modulus")):
        pairs = [
            mean_and_error([[np.log(row[name]) for row in seed] for seed in seeds], 0.01)
            for seeds in points.values()
        ]
        pressure = np.concatenate(
            [
                np.mean([[row["pressure"] for row in seed] for seed in seeds], axis=0)
                for seeds in points.values()
            ]
        )
        labels = [
            f"prepared with mu {mu:g}, {p / 1e3:.3g} kPa"
            for (mu,), seeds in points.items()
            for p in np.mean([[row["pressure"] for row in seed] for seed in seeds], axis=0)
        ]
        blocks.append(
            Block(
                f"isotropic {name}",
                labels,
                np.concatenate([m for m, _ in pairs]),
                np.concatenate([e for _, e in pairs]),
                MODEL_ERROR,
                lambda model, pressure=pressure, index=index: np.log(model.moduli(pressure)[index]),
            )
        )
    return blocks


def residuals(blocks: list[Block], model: Model) -> np.ndarray:
    """(model - measured)/sigma of every observation."""
    return np.concatenate(
        [(block.predict(model) - block.measured) / block.sigma for block in blocks]
    )


def to_vector(card: Card) -> np.ndarray:
    return np.array(
        [
            np.log(getattr(card, name)) if log else getattr(card, name)
            for name, _, _, log in PARAMETERS
        ]
    )


def to_card(vector: np.ndarray, start: Card) -> Card:
    return start.with_values(
        **{name: float(np.exp(x) if log else x) for x, (name, _, _, log) in zip(vector, PARAMETERS)}
    )


def minimise(blocks: list[Block], grains: Grains, start: Card):
    """scipy's least-squares result from `start`, in the vector of PARAMETERS."""
    lower, upper = (
        np.array([np.log(bounds[i]) if log else bounds[i] for _, *bounds, log in PARAMETERS])
        for i in (0, 1)
    )
    return least_squares(
        lambda x: residuals(blocks, Model(to_card(x, start), grains)),
        np.clip(to_vector(start), lower, upper),
        bounds=(lower, upper),
        loss="soft_l1",
        x_scale="jac",
    )


def fit(blocks: list[Block], grains: Grains, start: Card, resampled=()) -> Fit:
    """The card of least weighted distance to `blocks`, over the forms of the critical-state locus too.

    Several starts in e_c, because the pressure jumps there and the distance has local minima. `resampled` are further
    evidences (lists of blocks), each fitted from the solution for the bootstrap.
    """
    best = None
    for form, slope in zip(EXPONENT, (0.05, 0.5, 5.0)):
        for void_ratio in (0.69, 0.71, 0.73):
            trial = start.with_values(
                critical_state_form=form, critical_state_slope=slope, critical_void_ratio=void_ratio
            )
            result = minimise(blocks, grains, trial)
            if best is None or result.cost < best[0].cost:
                best = result, trial
    result, trial = best
    card = to_card(result.x, trial)
    chi_square = float(np.sum(residuals(blocks, Model(card, grains)) ** 2))
    freedom = len(result.fun) - len(result.x)
    covariance = np.linalg.pinv(result.jac.T @ result.jac) * max(1.0, 2 * result.cost / freedom)
    vectors = np.array([minimise(other, grains, card).x for other in resampled])
    scale = np.array([getattr(card, name) if log else 1.0 for name, _, _, log in PARAMETERS])
    spread = (
        vectors.std(axis=0, ddof=1) * scale if len(vectors) > 1 else np.full(len(scale), np.nan)
    )
    edges = [name for active, name in zip(result.active_mask, NAMES) if active]
    return Fit(
        card,
        dict(zip(NAMES, np.sqrt(np.diag(covariance)) * scale)),
        dict(zip(NAMES, spread)),
        chi_square,
        len(result.fun),
        edges,
    )


def resample(seed: int):
    """A `choose` for `evidence` that draws the seeds of each point anew, with replacement."""
    random = np.random.default_rng(seed)
    return lambda seeds: [seeds[i] for i in random.integers(len(seeds), size=len(seeds))]


def synthetic(blocks: list[Block], model: Model, seed: int) -> list[Block]:
    """The same observations as `model` would give them, with Gaussian noise of each one's sigma."""
    random = np.random.default_rng(seed)
    return [
        replace(
            block,
            measured=block.predict(model)
            + block.sigma * random.standard_normal(len(block.measured)),
        )
        for block in blocks
    ]
