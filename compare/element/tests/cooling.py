"""Homogeneous cooling of a granular gas, in LIGGGHTS.

Without friction the tangential model is left out: with mu = 0 it still damps once at every set-up
of a run.
"""

from pathlib import Path

import numpy as np

from compare.element.blocks import MODEL_ERROR, Block, Choose, by_point, mean_and_error
from compare.element.case import Case
from compare.element.charts import card_legend, colours, line_styles, plt, save, styled
from compare.element.model import Law
from compare.element.records import Rows
from compare.element.tests import ComparedTest, register
from dem_reference.grains import Grains
from dem_reference.periodic.box import Box
from dem_reference.periodic.start import box_side
from dem_reference.process import Report, run_engine

DILUTE = 0.4  # solid fraction to which g0 is Carnahan and Starling's, with friction or without


def points(case: Case) -> list[tuple[dict, int]]:
    """Seed by seed."""
    common = {
        name: case[f"cooling.{name}"]
        for name in ("granular_temperature", "cooling_times", "samples")
    }
    return [
        ({"solid_fraction": fraction, "friction": friction} | common, seed)
        for seed in case["element.seeds"]
        for friction in case["cooling.frictions"]
        for fraction in case["cooling.solid_fractions"]
    ]


def haff_rate(nu, restitution: float, temperature: float, diameter: float):
    """1/tau of T = T0/(1 + t/tau)^2 for hard frictionless spheres [1/s]; `nu` may be an array.

    1/tau = (4/sqrt(pi)) (1 - e^2) nu g0 sqrt(T0)/d, g0 = (2 - nu)/(2 (1 - nu)^3)
    (Carnahan-Starling).
    """
    g0 = (2 - nu) / (2 * (1 - nu) ** 3)
    return 4 / np.sqrt(np.pi) * (1 - restitution**2) * nu * g0 * np.sqrt(temperature) / diameter


def run(grains: Grains, point: dict, folder: Path) -> Rows:
    """Cools one box; one row per instant: time [s], temperature, rotational_temperature [m2/s2].

    `temperature` is <v^2>/3, `rotational_temperature` the mean of I omega^2/(3 m). The grains
    start without spin, their velocities Gaussian, without mean, of variance granular_temperature
    exactly.
    """
    log = folder / "log.liggghts"
    return run_engine(cool, grains, point, log, log=log).result


def cool(grains: Grains, point: dict, log: Path, report: Report) -> Rows:
    box = Box(
        grains,
        point["grains"],
        box_side(grains, point["grains"], point["solid_fraction"]),
        point["seed"],
        point["friction"],
        point["time_step_fraction"] * grains.rayleigh_time(),
        log,
        tangential=point["friction"] > 0,
    )
    t0 = point["granular_temperature"]
    velocity = np.random.default_rng(point["seed"]).standard_normal((point["grains"], 3))
    velocity -= velocity.mean(axis=0)
    velocity *= np.sqrt(3 * t0 / np.mean(np.sum(velocity**2, axis=1)))
    box.vectors("v")[:] = velocity
    box.vectors("omega")[:] = 0.0
    box.command("run 0 post no")

    haff = haff_rate(point["solid_fraction"], grains.restitution, t0, grains.diameter)
    duration = point["cooling_times"] / haff
    steps = max(1, round(duration / point["samples"] / box.time_step))
    rows = []
    for sample in range(point["samples"] + 1):
        if sample:
            box.advance(steps)
        moving, spinning = (
            np.mean(np.sum(box.vectors(name) ** 2, axis=1)) for name in ("v", "omega")
        )
        rows.append(
            {
                "time": sample * steps * box.time_step,
                "temperature": float(moving / 3),
                "rotational_temperature": float(0.1 * grains.diameter**2 * spinning / 3),
            }
        )
    return rows


def fitted(rows: Rows) -> Rows:
    """With friction and dilute: denser, the law's contact value is that of sheared grains."""
    return [row for row in rows if row["friction"] > 0 and row["solid_fraction"] <= DILUTE]


def haff_slope(rows: Rows) -> float:
    """ln of d(T^-1/2)/dt over the second half of a cooling curve.

    By then the spins have come to their share.
    """
    time = np.array([row["time"] for row in rows])
    inverse = np.array([row["temperature"] for row in rows]) ** -0.5
    late = slice(len(rows) // 2, None)
    return float(np.log(np.polyfit(time[late], inverse[late], 1)[0]))


def blocks(rows: Rows, choose: Choose) -> list[Block]:
    """The late cooling rate of every solid fraction.

    With friction the card's effective restitution is judged, without it plain kinetic theory.
    """
    rough = [row for row in rows if row["friction"] > 0]
    smooth = [row for row in rows if row["friction"] == 0]
    found = []
    if rough:
        found.append(rate_block("cooling rate", rough, choose, lambda law: law))
    if smooth:
        name = "frictionless cooling rate"
        found.append(rate_block(name, smooth, choose, lambda law: law.frictionless()))
    return found


def rate_block(kind: str, rows: Rows, choose: Choose, of_law) -> Block:
    """The late cooling rate; of_law(law) is the law that answers."""
    points = by_point(rows, ("solid_fraction",), choose)
    nu = np.array([point[0] for point in points])
    rates = [
        mean_and_error([haff_slope(seed) for seed in seeds], 0.02) for seeds in points.values()
    ]
    measured, error = np.array(rates).T
    ends = np.array(
        [
            [
                np.mean([seed[at]["temperature"] for seed in seeds])
                for at in (len(seeds[0]) // 2, -1)
            ]
            for seeds in points.values()
        ]
    ).T

    def predict(law: Law) -> np.ndarray:
        first, last = (of_law(law).cooling_time(nu, 1.0, T) for T in ends)
        return np.log((ends[1] ** -0.5 - ends[0] ** -0.5) / (last - first))

    return Block(kind, [f"nu {x:g}" for x in nu], measured, error, MODEL_ERROR, predict)


@styled
def draw(rows: Rows, models: dict[str, Law], path: Path) -> list[Path]:
    """Granular temperature over time, without and with friction, and the late cooling rate.

    `rows` of the reference, `models` by card name; without friction the cards are all one, plain
    kinetic theory.
    """
    points = by_point(rows, ("friction", "solid_fraction"))
    frictions = sorted({mu for mu, _ in points})
    figure, panels = plt.subplots(
        1, len(frictions) + 1, figsize=(5 * (len(frictions) + 1), 4.2), layout="constrained"
    )
    one = next(iter(models.values()))
    for mu, axes, marker in zip(frictions, panels, "os^v"):
        laws = models if mu else {"kinetic theory": one.frictionless()}
        curves(axes, mu, points, laws)
        late_rates(panels[-1], mu, points, laws, marker)
    panels[-1].set(
        xlabel="solid fraction ν",
        ylabel="late cooling rate d(T^-1/2)/dt, relative to Haff's",
        ylim=(0, None),
    )
    panels[-1].legend(fontsize=8)
    card_legend(panels[len(frictions) - 1], models)
    figure.suptitle("Homogeneous cooling")
    return save(figure, path)


def curves(axes, mu: float, points: dict, laws: dict[str, Law]) -> None:
    """Temperature over time at friction `mu`, a colour per solid fraction; bands span the seeds."""
    grains = next(iter(laws.values())).grains
    fractions = sorted({nu for _, nu in points})
    for nu, colour in zip(fractions, colours(len(fractions))):
        seeds = points.get((mu, nu))
        if not seeds:
            continue
        T0 = seeds[0][0]["granular_temperature"]
        unit = 1 / haff_rate(nu, grains.restitution, T0, grains.diameter)
        time = np.array([row["time"] for row in seeds[0]]) / unit
        found = np.array([[row["temperature"] for row in seed] for seed in seeds])
        axes.fill_between(
            time, found.min(0) / T0, found.max(0) / T0, color=colour, alpha=0.3, linewidth=0
        )
        mean = found.mean(0)[::4] / T0
        axes.plot(time[::4], mean, "o", markersize=3, color=colour, label=f"ν = {nu:g}")
        temperature = np.geomspace(T0, found.min(), 100)
        for law, style in zip(laws.values(), line_styles(laws).values()):
            cooled = law.cooling_time(nu, T0, temperature) / unit
            axes.plot(cooled, temperature / T0, style, color=colour, linewidth=1.1)
    axes.set(
        xlabel="t / τ, Haff time of hard frictionless spheres",
        ylabel="T / T₀",
        yscale="log",
        title=f"μ = {mu:g}",
    )
    axes.legend(fontsize=8, title="solid fraction")


def late_rates(axes, mu: float, points: dict, laws: dict[str, Law], marker: str) -> None:
    """The late cooling rate at friction `mu` over solid fraction, relative to Haff's."""
    grains = next(iter(laws.values())).grains
    fractions = sorted({nu for _, nu in points})
    slopes = []
    for nu in fractions:
        seeds = points.get((mu, nu))
        if not seeds:
            continue
        T0 = seeds[0][0]["granular_temperature"]
        unit = 1 / haff_rate(nu, grains.restitution, T0, grains.diameter)
        rates = [np.exp(haff_slope(seed)) * np.sqrt(T0) * unit for seed in seeds]
        slopes.append((nu, *mean_and_error(rates)))
    axes.errorbar(
        *np.array(slopes).T[:2],
        np.array(slopes).T[2],
        fmt=marker,
        markersize=4,
        color="k",
        label=f"DEM, μ = {mu:g}",
        markerfacecolor="w" if mu == 0 else "k",
    )
    fine = np.linspace(fractions[0], fractions[-1], 50)
    first, last = np.array([[0.2], [0.05]]) * T0
    haff = haff_rate(fine, grains.restitution, T0, grains.diameter)
    for (name, law), style in zip(laws.items(), line_styles(laws).values()):
        duration = law.cooling_time(fine, T0, last) - law.cooling_time(fine, T0, first)
        rate = (last**-0.5 - first**-0.5) / duration * np.sqrt(T0) / haff
        axes.plot(fine, rate, style, color="C0" if mu else "C1", label=f"{name}, μ = {mu:g}")


register(
    ComparedTest(
        "cooling",
        order=2,
        keys=("solid_fraction", "friction"),
        points=points,
        run=run,
        blocks=blocks,
        draw=draw,
        fitted=fitted,
    )
)
