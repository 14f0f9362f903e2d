"""Fit the law's constants to the element tests of the grains, and write a material card.

Only the references of the element tests in which the law is held against the grains are used, never
a column. The card is written with the uncertainty of every constant, beside a table that shows it
next to the seed's Table 1.
"""

from math import isnan
from pathlib import Path

from cases import command_line
from cases.errors import CaseError
from cases.files import check, write_atomically
from cases.programs import ROOT
from cases.provenance import commit
from compare.element import calibration
from compare.element.blocks import MODEL_ERROR, Block
from compare.element.calibration import Fit, names
from compare.element.card import Card
from compare.element.model import Model
from compare.element.tests import compared_tests
from dem_reference.grains import Grains

MADE = "# Command: grainpair calibrate"  # in the head of a card
# What a card says of the grains it was fitted to; cases are held against it (cases/constants.cpp).
FITTED_TO = ("diameter", "density", "young_modulus", "restitution", "friction")
WHERE_THEY_HAVE_IT = ("size_spread", "rolling_friction")
SYMBOLS = {
    "critical_void_ratio": "e_c",
    "critical_state_slope": "a_L",
    "stress_ratio": "M_c",
    "bulk_stiffness": "k",
    "shear_stiffness": "g",
    "stiffness_exponent": "n",
    "dilatancy": "δ",
    "effective_restitution": "ε_eff",
    "collision_time_factor": "t_c factor",
    "correlation_factor": "L factor",
    "correlation_onset": "Y₀",
    "contact_share": "χ",
    "fabric_strain": "γ_s",
}


# Laws that can be fitted, and what they begin with in place of the start's.
LAWS: dict[str, dict] = {
    "solid_fluid": {},
    "contact_share": {"correlation_length": "softened", "fabric_strain": 0.2},
}

PACKAGES = ["studies"]


def arguments(parser):
    parser.add_argument(
        "--start",
        default="seed_table1",
        metavar="NAME",
        help="card the fit starts from (default: seed_table1)",
    )
    parser.add_argument(
        "--law",
        default="solid_fluid",
        choices=sorted(LAWS),
        help="law whose constants are fitted (default: solid_fluid)",
    )
    parser.add_argument(
        "--card", default="dem_mu05", metavar="NAME", help="card to write (default: dem_mu05)"
    )
    parser.add_argument(
        "--correlation",
        choices=["berzi", "jenkins"],
        help="correlation length of the law that is fitted (default: the start's)",
    )
    parser.add_argument(
        "--cases",
        type=Path,
        default=ROOT / "cases",
        metavar="DIR",
        help="folder of the element tests and their references",
    )
    parser.add_argument(
        "--grains",
        default="",
        metavar="NAME",
        help="kind of grains: folders <test>/NAME of the element tests, such as rolling (default: "
        "those of the tests themselves)",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=ROOT / "cases" / "materials",
        metavar="DIR",
        help="where the card and the table go",
    )
    parser.add_argument(
        "--replace", action="store_true", help="also replace a card that was not made by calibrate"
    )
    parser.add_argument(
        "--bootstrap",
        type=command_line.whole(0, 10_000),
        default=30,
        metavar="N",
        help="fits to resampled seeds (default: 30)",
    )


def run(options) -> int:
    card_file, table_file = (options.out / f"{options.card}.{suffix}" for suffix in ("toml", "md"))
    for file in (card_file, table_file):
        check(file)
    if card_file.exists() and MADE not in card_file.read_text() and not options.replace:
        raise CaseError(
            f"{card_file}: is there, and was not made by calibrate (it would be lost) give another "
            "--card, or --replace"
        )
    _, grains = calibration.evidence(options.cases, kind=options.grains)
    start = start_of(options, grains)
    blocks, _ = calibration.evidence(options.cases, card=start, kind=options.grains)
    resampled = [
        calibration.evidence(options.cases, calibration.resample(seed), start, options.grains)[0]
        for seed in range(options.bootstrap)
    ]
    fit = calibration.fit(blocks, grains, start, resampled)
    card = card_text(fit, blocks, grains, options)
    write_atomically(card_file, card)
    write_atomically(table_file, table_text(fit, start, options))
    print(table_text(fit, start, options), end="")
    print(card_file, table_file, sep="\n")
    return 0


def start_of(options, grains: Grains) -> Card:
    """The card that the fit starts from, with the correlation length that was asked for and an
    effective restitution of its own.
    """
    card = Card.read(options.start).with_values(law=options.law, **LAWS[options.law])
    if options.correlation:
        card = card.with_values(correlation_length=options.correlation)
    return card.with_values(effective_restitution=Model(card, grains).effective_restitution)


def card_text(fit: Fit, blocks: list[Block], grains: Grains, options) -> str:
    """The material card, with where it comes from and every constant's uncertainty in comments."""
    *most, last = (test.name for test in compared_tests() if test.within(fit.card))
    lines = [
        f"# {options.card}: calibrated on grains of d = {grains.diameter * 1e3:g} mm, "
        f"E_p = {grains.young_modulus:g} Pa, e_n = {grains.restitution:g}, "
        f"mu = {grains.friction:g}"
        + (f", rolling friction {grains.rolling_friction:g}," if grains.rolls else ","),
        f"# in the element tests {', '.join(most)} and {last} alone; no column was used.",
        f"{MADE} --law {options.law} --start {options.start} --card {options.card} "
        f"--bootstrap {options.bootstrap}"
        + (f" --correlation {options.correlation}" if options.correlation else "")
        + (f" --grains {options.grains}" if options.grains else ""),
        f"# Commit: {commit()}. Start: {options.start}, whose other constants are kept.",
        f"# {fit.observations} observations, chi-square {fit.chi_square:.0f} with a model error of "
        f"{MODEL_ERROR:.0%} beside the DEM's:",
        "# 1 per observation would be a perfect law, so most of the rest is what the law cannot "
        "follow.",
    ]
    for block in blocks:
        lines.append(
            f"#   {block.kind}: {len(block.measured)} points, DEM scatter {block.error.mean():.3f}"
        )
    lines += [
        "# +-: standard error from the covariance, scaled by the misfit; in brackets the scatter "
        "over fits to resampled seeds.",
        "[grains]  # of the element tests",
        *(f"{name} = {getattr(grains, name):g}" for name in FITTED_TO),
        *(
            f"{name} = {getattr(grains, name):g}"
            for name in WHERE_THEY_HAVE_IT
            if getattr(grains, name)
        ),
        "",
        "[material]",
    ]
    for name in names(fit.card):
        bound = (
            "; at the edge of its interval: not determined by these tests"
            if name in fit.at_bound
            else ""
        )
        lines.append(
            f"{name} = {getattr(fit.card, name):.4g}  # {SYMBOLS[name]} +- "
            f"{fit.standard_error[name]:.2g}{over_seeds(fit, name)}{bound}"
        )
    if fit.card.law != "solid_fluid":
        lines.append(f'law = "{fit.card.law}"')
    lines += [
        f'critical_state_form = "{fit.card.critical_state_form}"'
        "  # of the three forms the one that fits best",
        f'correlation_length = "{fit.card.correlation_length}"',
        f"loose_void_ratio = {fit.card.loose_void_ratio:g}  # kept from {options.start}",
    ]
    return "\n".join(lines) + "\n"


def over_seeds(fit: Fit, name: str) -> str:
    """The scatter over fits to resampled seeds in brackets; none without such fits."""
    return "" if isnan(fit.bootstrap[name]) else f" ({fit.bootstrap[name]:.2g})"


def table_text(fit: Fit, start: Card, options) -> str:
    """A Markdown table of both cards side by side."""
    lines = [
        f"| constant | key | {options.start} | {options.card} | ± (misfit) | ± (seeds) |",
        "|---|---|---|---|---|---|",
    ]
    for name in names(fit.card):
        edge = " (edge)" if name in fit.at_bound else ""
        lines.append(
            f"| {SYMBOLS[name]} | {name} | {getattr(start, name):.4g} | "
            f"{getattr(fit.card, name):.4g}{edge} | {fit.standard_error[name]:.2g} | "
            f"{'–' if isnan(fit.bootstrap[name]) else format(fit.bootstrap[name], '.2g')} |"
        )
    forms = f"{start.critical_state_form} | {fit.card.critical_state_form}"
    lines.append(f"| form of G₁ | critical_state_form | {forms} | | |")
    return "\n".join(lines) + "\n"
