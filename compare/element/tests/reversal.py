"""Start and reversal of simple shear at constant volume, in LAMMPS with Lees-Edwards boundaries.

What steady shear cannot tell: over which strain contacts come to carry shear, and how the stress
follows a flow that turns round.
"""

from functools import lru_cache
from pathlib import Path

import numpy as np

from cases.errors import EngineError
from compare.element.blocks import MODEL_ERROR, Block, Choose, by_point, mean_and_error
from compare.element.case import Case
from compare.element.charts import card_legend, colours, line_styles, plt, save, styled
from compare.element.model import Law
from compare.element.records import Rows
from compare.element.tests import ComparedTest, register
from compare.element.tests.shear import BOLTZMANN, GROWN, MEASURING, grown, write_data
from dem_reference import lammps
from dem_reference.grains import Grains
from dem_reference.periodic.start import box_side, random_positions

# The grains come to rest with friction before they are sheared; when the flow turns round, their
# fluctuations stay.
SCRIPT = (
    GROWN
    + """\
run {rest_steps}
velocity all set 0 0 0
set group all omega 0 0 0
reset_timestep 0
velocity all ramp vx 0 {top_speed} y 0 {side} sum yes units box
fix shear all deform 1 xy erate {rate} remap v flip yes
"""
    + MEASURING
    + """\
run {steps}
unfix shear
velocity all ramp vx 0 {back_speed} y 0 {side} sum yes units box
fix shear all deform 1 xy erate -{rate} remap v flip yes
run {steps}
"""
)
WINDOW = 0.02  # strain over which the grains are averaged at least
# Strains between which rows are averaged: what changes, changes at first.
EDGES = WINDOW * np.array([0, 1, 2, 3, 5, 7, 10, 15, 20, 30, 50, 75, 100])
MEASURED = ("granular_temperature", "pressure", "shear_stress")
LOOSER = 0.585  # solid fraction where grains of friction 0.5 jam when sheared slowly
SAMPLES = 5  # of the law in each interval
RATIO_ERROR = 0.02  # of s/p, MODEL_ERROR of its steady value


def points(case: Case) -> list[tuple[dict, int]]:
    """All solid fractions at the first rate, seed by seed, then the next rate."""
    return [
        ({"solid_fraction": fraction, "shear_rate": rate, "strain": case["reversal.strain"]}, seed)
        for rate in case["reversal.rates"]
        for seed in case["element.seeds"]
        for fraction in case["reversal.solid_fractions"]
    ]


def run(grains: Grains, point: dict, folder: Path) -> Rows:
    """Shears one box from rest to `strain`, and back by twice as much in the opposite sense.

    `point`: solid_fraction [-], shear_rate [1/s], strain [-], seed, grains (number),
    time_step_fraction of the Rayleigh time. Rows as of `averaged`.
    """
    side = box_side(grains, point["grains"], point["solid_fraction"])
    centres, d0 = random_positions(point["grains"], side, point["seed"])
    write_data(folder / "grains.data", grains, centres, d0, side)
    fixed = grown(grains, point, side, d0)
    rate = point["shear_rate"]
    window = 10 * round(WINDOW / (rate * fixed["dt"]) / 10)
    lammps.run(
        SCRIPT.format(
            **fixed,
            rate=rate,
            rest_steps=20000,
            top_speed=rate * side,
            back_speed=-2 * rate * side,
            window=window,
            samples=window // 10,
            steps=window * round(point["strain"] / WINDOW),
        ),
        folder,
    )
    windows = np.loadtxt(folder / "mean.txt")[:, 1:]
    return averaged(grains, windows, round(point["strain"] / WINDOW))


def averaged(grains: Grains, windows: np.ndarray, reversal: int) -> Rows:
    """Means between EDGES since the start and since the reversal, after `reversal` windows.

    `windows`: (n, 6) as LAMMPS writes them. A row has reversed (0 or 1), strain_from and
    strain_to (since start or reversal) [-], granular_temperature [m2/s2] (affine flow removed),
    pressure, shear_stress (in the sense of the flow) [Pa] and coordination [-].
    """
    if not np.isfinite(windows).all() or len(windows) != 2 * reversal:
        raise EngineError(
            f"reversal: not all of {2 * reversal} windows are there and finite (the run broke off)"
        )
    rows = []
    for turned, leg in enumerate((windows[:reversal], windows[reversal:])):
        for first, last in zip(EDGES[:-1], EDGES[1:]):
            a, b = round(first / WINDOW), round(last / WINDOW)  # windows
            T, xx, yy, zz, xy, z = leg[a:b].mean(axis=0)
            rows.append(
                {
                    "reversed": turned,
                    "strain_from": first,
                    "strain_to": last,
                    "granular_temperature": float(T * BOLTZMANN / grains.mass),
                    "pressure": float((xx + yy + zz) / 3),
                    "shear_stress": float(xy if turned else -xy),
                    "coordination": float(z),
                }
            )
    return rows


def fitted(rows: Rows) -> Rows:
    """Up to the critical solid fraction: denser, quasi-static stress carries most of the pressure.

    That part of the law has no memory, where the grains' falls a hundredfold when the flow turns.
    """
    return [row for row in rows if row["solid_fraction"] <= LOOSER]


def curve(rows: Rows, turned: int) -> np.ndarray:
    """T, p and s/p of one run from its start, or since its reversal: (3, intervals)."""
    leg = [row for row in rows if row["reversed"] == turned]
    T, p, s = (np.array([row[name] for row in leg]) for name in MEASURED)
    return np.array([T, p, s / p])


def answer(law: Law, nu, rate, span: float) -> np.ndarray:
    """As `curve`, of the law, of several points: (from its start or since its reversal, 3, points,
    intervals)."""
    inside = (np.arange(SAMPLES) + 0.5) / SAMPLES
    strain = EDGES[:-1, None] + np.diff(EDGES)[:, None] * inside
    found = law.reversal(nu, rate, strain.ravel(), span)
    T, p, s = (found[name].reshape(2, -1, *strain.shape).mean(axis=-1) for name in MEASURED)
    return np.stack([T, p, s / p], axis=1)


def blocks(rows: Rows, choose: Choose) -> list[Block]:
    """Temperature, pressure and shear over pressure along the strain, from rest and turned round.

    Every curve counts as one observation.
    """
    points = by_point(rows, ("solid_fraction", "shear_rate"), choose)
    span = rows[0]["strain"]
    count = len(EDGES) - 1
    nu, rate = np.array(list(points)).T
    # of the law that was asked last: six blocks ask it for the same
    answered = lru_cache(maxsize=1)(lambda law: answer(law, nu, rate, span))
    labels = [f"nu {a:g}, {b:g} /s, strain {x:g}" for a, b in points for x in EDGES[1:]]

    def block(turned: int, i: int, name: str) -> Block:
        plain = i == 2
        curves = [[curve(seed, turned)[i] for seed in seeds] for seeds in points.values()]
        pairs = [mean_and_error(seeds if plain else np.log(seeds)) for seeds in curves]
        measured, error = (np.concatenate(part) for part in zip(*pairs))

        def predict(law: Law) -> np.ndarray:
            found = answered(law)[turned, i].ravel()
            return found if plain else np.log(found)

        kind = f"{'turned' if turned else 'started'} {name}"
        floor = RATIO_ERROR if plain else MODEL_ERROR
        return Block(kind, labels, measured, error, floor, predict, count)

    names = ("granular_temperature", "pressure", "shear over pressure")
    return [block(turned, i, name) for turned in (0, 1) for i, name in enumerate(names)]


@styled
def draw(rows: Rows, models: dict[str, Law], path: Path) -> list[Path]:
    """Temperature, pressure and shear over pressure along the strain, a column per shear rate.

    `rows` of the reference, `models` by card name; bands span the seeds, the reversal is at 0.
    """
    points = by_point(rows, ("shear_rate", "solid_fraction"))
    grains = next(iter(models.values())).grains
    rates, fractions = (sorted({point[i] for point in points}) for i in (0, 1))
    span = rows[0]["strain"]
    middle = (EDGES[1:] + EDGES[:-1]) / 2
    strain = np.concatenate([middle - span, middle])
    figure, panels = plt.subplots(
        3, len(rates), figsize=(5.5 * len(rates), 9), sharex=True, squeeze=False
    )
    for (rate, nu), seeds in points.items():
        colour = colours(len(fractions))[fractions.index(nu)]
        column = panels[:, rates.index(rate)]
        scales = 1 / np.array([(rate * grains.diameter) ** 2, 1.0, 1.0])
        found = np.array([np.concatenate([curve(seed, 0), curve(seed, 1)], 1) for seed in seeds])
        laws = [np.concatenate(answer(law, nu, rate, span)[:, :, 0], 1) for law in models.values()]
        for i, (axes, scale) in enumerate(zip(column, scales)):
            values = scale * found[:, i]
            axes.fill_between(strain, values.min(0), values.max(0), color=colour, alpha=0.25)
            axes.plot(strain, values.mean(0), "o", ms=3, color=colour, label=f"ν = {nu:g}")
            for law, style in zip(laws, line_styles(models).values()):
                axes.plot(strain, scale * law[i], style, color=colour, linewidth=1.1)
        column[0].set(title=f"{rate:g} /s", yscale="log")
        column[1].set(yscale="log")
        # a law without contacts at rest begins far above
        column[2].set(xlabel="strain since the reversal", ylim=(-0.3, 1.3))
    for axes, label in zip(panels[:, 0], ("T / (γ̇d)²", "p [Pa]", "s / p")):
        axes.set_ylabel(label)
    panels[0, -1].legend(fontsize=8)
    card_legend(panels[2, 0], models)
    figure.suptitle("Simple shear at constant volume, from rest and turned round")
    return save(figure, path)


register(
    ComparedTest(
        "reversal",
        order=6,
        keys=("solid_fraction", "shear_rate"),
        points=points,
        run=run,
        blocks=blocks,
        draw=draw,
        fitted=fitted,
        within=lambda card: card.fabric_strain > 0,
    )
)
