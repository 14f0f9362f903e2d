"""Fits a material card to the DEM element tests, and to nothing else: never to a column.

What is compared, and with which weight, blocks.py says. A soft-L1 loss keeps what the law cannot
follow from bending the rest.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cases.errors import CaseError
from cases.programs import short
from compare.element import records
from compare.element.blocks import Block, Choose, every
from compare.element.case import Case
from compare.element.card import Card
from compare.element.model import EXPONENT, Law, Model
from compare.element.tests import compared_tests
from dem_reference.grains import Grains

# What may be fitted, and the interval it may take: (name, lower, upper, fitted through its
# logarithm). Below delta = 0.05 the dilatancy is at its bound whenever it is not zero, so a smaller
# delta says nothing more.
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
    ("correlation_onset", 0.5, 200.0, True),
    ("contact_share", 0.0, 2.0, False),
    ("fabric_strain", 0.01, 5.0, True),
)


@dataclass(frozen=True)
class Fit:
    card: Card
    standard_error: dict  # by parameter, from the covariance scaled by the reduced chi-square
    bootstrap: dict  # by parameter, standard deviation over fits to resampled seeds
    chi_square: float
    observations: int
    at_bound: list[str]  # parameters at the edge of their interval: not determined by the data


def evidence(
    cases: Path, choose: Choose = every, card: Card | None = None, kind: str = ""
) -> tuple[list[Block], Grains]:
    """The blocks of all element tests under the folder `cases`, those of the `kind` of grains that
    they have a folder of, and the grains they share.

    Without those that the law of `card`, if one is given, cannot follow. CaseError where a test has
    no measured point, or grains of its own.
    """
    blocks: list[Block] = []
    grains: set[Grains] = set()
    for test in compared_tests():
        case = Case(cases / test.name / kind)
        rows = records.measured(case)
        if not rows:
            raise CaseError(
                f"{records.reference_file(case)}: no measured point. Run: grainpair element "
                f"{short(case.folder)}"
            )
        grains.add(case.grains)
        if len(grains) > 1:
            raise CaseError(
                f"{case.path}: its grains differ from the other tests' (a card belongs to one kind "
                "of grain)"
            )
        if card is None or test.within(card):
            blocks += test.blocks(test.fitted(rows), choose)
    return blocks, grains.pop()


def residuals(blocks: list[Block], model: Law) -> np.ndarray:
    """(model - measured)/sigma of every observation."""
    return np.concatenate(
        [(block.predict(model) - block.measured) / block.sigma for block in blocks]
    )


def fitted(card: Card) -> list[tuple[str, float, float, bool]]:
    """Those of PARAMETERS that the card's law has."""
    softened = card.correlation_length == "softened"
    without = {"correlation_factor"} if softened else {"correlation_onset"}
    if card.law != "contact_share":
        without.add("contact_share")
    if card.fabric_strain == 0:
        without.add("fabric_strain")
    return [parameter for parameter in PARAMETERS if parameter[0] not in without]


def names(card: Card) -> list[str]:
    """Of the constants that are fitted."""
    return [name for name, *_ in fitted(card)]


def to_vector(card: Card) -> np.ndarray:
    return np.array(
        [
            np.log(getattr(card, name)) if log else getattr(card, name)
            for name, _, _, log in fitted(card)
        ]
    )


def to_card(vector: np.ndarray, start: Card) -> Card:
    return start.with_values(
        **{
            name: float(np.exp(x) if log else x)
            for x, (name, _, _, log) in zip(vector, fitted(start))
        }
    )


def minimise(blocks: list[Block], grains: Grains, start: Card):
    """scipy's least-squares result from `start`, in the vector of what is fitted."""
    from scipy.optimize import least_squares  # of packages-studies.txt

    lower, upper = (
        np.array([np.log(bounds[i]) if log else bounds[i] for _, *bounds, log in fitted(start)])
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
    """The card of least weighted distance to `blocks`.

    Over the forms of the critical-state locus too, with several starts in e_c, because the pressure
    jumps there and the distance has local minima. `resampled` are further evidences (lists of
    blocks), each fitted from the solution for the bootstrap.
    """
    trials = [
        start.with_values(
            critical_state_form=form, critical_state_slope=slope, critical_void_ratio=void_ratio
        )
        for form, slope in zip(EXPONENT, (0.05, 0.5, 5.0))
        for void_ratio in (0.69, 0.71, 0.73)
    ]
    results = [minimise(blocks, grains, trial) for trial in trials]
    result, trial = min(zip(results, trials), key=lambda pair: pair[0].cost)
    card = to_card(result.x, trial)
    chi_square = float(np.sum(residuals(blocks, Model(card, grains)) ** 2))
    freedom = len(result.fun) - len(result.x)
    covariance = np.linalg.pinv(result.jac.T @ result.jac) * max(1.0, 2 * result.cost / freedom)
    vectors = np.array([minimise(other, grains, card).x for other in resampled])
    scale = np.array([getattr(card, name) if log else 1.0 for name, _, _, log in fitted(card)])
    spread = (
        vectors.std(axis=0, ddof=1) * scale if len(vectors) > 1 else np.full(len(scale), np.nan)
    )
    edges = [name for active, name in zip(result.active_mask, names(card)) if active]
    return Fit(
        card,
        dict(zip(names(card), np.sqrt(np.diag(covariance)) * scale)),
        dict(zip(names(card), spread)),
        chi_square,
        len(result.fun),
        edges,
    )


def resample(seed: int) -> Choose:
    """A `choose` for `evidence` that draws the seeds of each point anew, with replacement."""
    random = np.random.default_rng(seed)
    return lambda seeds: [seeds[i] for i in random.integers(len(seeds), size=len(seeds))]


def synthetic(blocks: list[Block], model: Law, seed: int) -> list[Block]:
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
