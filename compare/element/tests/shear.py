"""Homogeneous simple shear at constant volume, in LAMMPS with Lees-Edwards boundaries.

LAMMPS rather than LIGGGHTS because the latter deletes grains that cross a face of a triclinic box.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from cases.errors import EngineError
from cases.programs import ROOT
from compare.element import cross_check, records
from compare.element.blocks import MODEL_ERROR, Block, Choose, by_point, mean_and_error
from compare.element.case import Case
from compare.element.charts import card_legend, colours, line_styles, plt, save, styled
from compare.element.model import Law
from compare.element.records import Rows
from compare.element.tests import ComparedTest, register
from dem_reference import lammps
from dem_reference.grains import Grains
from dem_reference.periodic.start import box_side, random_positions

BOLTZMANN = 1.380649e-23  # [J/K] in LAMMPS's si units
MEASURED = ("granular_temperature", "pressure", "shear_stress", "coordination")
# Grains grown in a periodic box, without friction and then with it.
GROWN = """\
units si
atom_style sphere 1
atom_modify map array
boundary p p p
newton off
comm_modify vel yes
box tilt large
read_data grains.data
pair_style granular
pair_coeff * * hertz/material {E} {e} {nu} tangential mindlin NULL 1.0 0.0{free} damping tsuji
neighbor {d} bin
neigh_modify delay 0
timestep {dt}
variable d equal ramp({d0},{d})
fix move all nve/sphere
fix grow all adapt 20 atom diameter v_d mass yes
run {grow_steps}
unfix grow
neighbor {skin} bin
reset_timestep 0
set group all diameter {d}
set group all density {rho}
pair_coeff * * hertz/material {E} {e} {nu} tangential mindlin NULL 1.0 {mu}{rolling} damping tsuji
"""
# What is measured in a sheared box, every `window` steps: T, xx, yy, zz and xy of the stress,
# coordination.
MEASURING = """\
compute T all temp/deform
compute P all pressure T
compute z all contact/atom
compute zm all reduce ave c_z
thermo_style custom step c_T c_P
thermo_modify lost error norm no flush yes
thermo {window}
fix mean all ave/time 10 {samples} {window} c_T c_P[1] c_P[2] c_P[3] c_P[4] c_zm file mean.txt
"""
SCRIPT = (
    GROWN
    + """\
velocity all create {temperature} {velocity_seed} dist gaussian
velocity all ramp vx 0 {top_speed} y 0 {side} sum yes units box
fix shear all deform 1 xy erate {rate} remap v flip yes
"""
    + MEASURING
    + "run {steps}\n"
)


def points(case: Case) -> list[tuple[dict, int]]:
    """All void ratios at the first rate, seed by seed, then the next rate."""
    strain = {"strain": case["shear.strain"], "strain_discarded": case["shear.strain_discarded"]}
    return [
        ({"solid_fraction": fraction, "shear_rate": rate} | strain, seed)
        for rate in case["shear.rates"]
        for seed in case["element.seeds"]
        for fraction in case["shear.solid_fractions"]
    ]


def run(grains: Grains, point: dict, folder: Path) -> Rows:
    """Shears one box to its steady state and returns one row, of its means.

    `point`: solid_fraction [-], shear_rate [1/s], seed, grains (number), strain and
    strain_discarded [-], time_step_fraction of the Rayleigh time. The row holds what `means` does.
    """
    side = box_side(grains, point["grains"], point["solid_fraction"])
    centres, d0 = random_positions(point["grains"], side, point["seed"])
    write_data(folder / "grains.data", grains, centres, d0, side)

    dt = point["time_step_fraction"] * grains.rayleigh_time()
    rate = point["shear_rate"]
    window = 10 * round(0.5 / (rate * dt) / 10)
    guess = 0.3 * (rate * grains.diameter) ** 2
    lammps.run(
        SCRIPT.format(
            **grown(grains, point, side, d0),
            rate=rate,
            temperature=grains.mass * guess / BOLTZMANN,
            velocity_seed=10007 + point["seed"],
            top_speed=rate * side,
            window=window,
            samples=window // 10,
            steps=window * round(2 * point["strain"]),
        ),
        folder,
    )
    windows = np.loadtxt(folder / "mean.txt")[:, 1:]
    return [means(grains, windows[round(2 * point["strain_discarded"]) :])]


def grown(grains: Grains, point: dict, side: float, diameter: float) -> dict:
    """What GROWN holds for: grains of `diameter` [m] that grow to their own in a cube of `side`."""
    speed = point["shear_rate"] * grains.diameter
    return {
        "E": grains.young_modulus,
        "e": lammps.restitution_to_enter(grains.restitution),
        "nu": grains.poisson_ratio,
        "mu": grains.friction,
        "rolling": lammps.rolling_words(grains, speed),
        # Grown without resistance, but with the springs of it: a contact's history keeps the size
        # that it has in the first run.
        "free": lammps.rolling_words(grains, speed, bound=0.0),
        "rho": grains.density,
        "d": grains.diameter,
        "d0": diameter,
        "side": side,
        "dt": point["time_step_fraction"] * grains.rayleigh_time(),
        "skin": 0.2 * grains.diameter,
        "grow_steps": 20000,
    }


def means(grains: Grains, windows: np.ndarray) -> dict:
    """Of the steady state, from windows of half a unit of strain, (n, 6) as LAMMPS writes them.

    granular_temperature [m2/s2] (affine flow removed), pressure and shear_stress [Pa] (contact and
    kinetic parts), coordination [-], first and second normal stress differences over p [-], and
    for the four of MEASURED the standard error of the mean over windows.
    """
    if not np.isfinite(windows).all() or len(windows) < 2:
        raise EngineError(
            f"shear: no steady state was averaged ({len(windows)} finite windows) "
            "lengthen the strain"
        )
    temperature = windows[:, 0] * BOLTZMANN / grains.mass
    xx, yy, zz, xy = windows[:, 1:5].T
    pressure = (xx + yy + zz) / 3
    series = dict(zip(MEASURED, (temperature, pressure, -xy, windows[:, 5])))
    result = {name: float(values.mean()) for name, values in series.items()}
    result |= {
        f"{name}_error": float(values.std(ddof=1) / np.sqrt(len(values)))
        for name, values in series.items()
    }
    return result | {
        "normal_difference_1": float((xx - yy).mean() / pressure.mean()),
        "normal_difference_2": float((yy - zz).mean() / pressure.mean()),
    }


def write_data(
    path: Path, grains: Grains, centres: np.ndarray, diameter: float, side: float
) -> None:
    """A LAMMPS data file: grains of one `diameter` [m] in a periodic cube that may be sheared."""
    lines = [
        "grains",
        "",
        f"{len(centres)} atoms",
        "1 atom types",
        *(f"0 {side:.17g} {a}lo {a}hi" for a in "xyz"),
        "0 0 0 xy xz yz",
        "",
        "Atoms # sphere",
        "",
    ]
    lines += [
        f"{i} 1 {diameter:.17g} {grains.density} {x:.17g} {y:.17g} {z:.17g}"
        for i, (x, y, z) in enumerate(centres, 1)
    ]
    path.write_text("\n".join(lines) + "\n")


def blocks(rows: Rows, choose: Choose) -> list[Block]:
    """Temperature, pressure and shear stress of every solid fraction and rate."""
    points = by_point(rows, ("solid_fraction", "shear_rate"), choose)
    nu, rate = np.array(list(points)).T
    return [
        shear_block(name, points, lambda law, name=name: np.log(law.shear(nu, rate)[name]))
        for name in ("granular_temperature", "pressure", "shear_stress")
    ]


def shear_block(name: str, points: dict[tuple, list[Rows]], predict) -> Block:
    pairs = [
        mean_and_error(
            [np.log(seed[0][name]) for seed in seeds],
            np.mean([seed[0][f"{name}_error"] / seed[0][name] for seed in seeds])
            / np.sqrt(len(seeds)),
        )
        for seeds in points.values()
    ]
    measured, error = np.array(pairs).T
    labels = [f"nu {a:g}, {b:g} /s" for a, b in points]
    return Block(f"shear {name}", labels, measured, error, MODEL_ERROR, predict)


@styled
def draw(rows: Rows, models: dict[str, Law], path: Path) -> list[Path]:
    """Pressure, granular temperature and stress ratio over solid fraction and shear rate.

    `rows` of the reference, `models` by card name; DEM points carry their standard error over
    seeds.
    """
    figure, ((a, b), (c, d)) = plt.subplots(2, 2, figsize=(10, 7.5), layout="constrained")
    points = by_point(rows, ("shear_rate", "solid_fraction"))
    over_solid_fraction((a, b, c), points, models)
    over_rate(d, points, models)
    a.set_ylabel("p / ρ(γ̇d)²")
    b.set_ylabel("T / (γ̇d)²")
    c.set_ylabel("s / p")
    d.set(xlabel="shear rate γ̇ [1/s]", ylabel="p [Pa]", xscale="log", yscale="log")
    d.legend(fontsize=7, ncols=2)
    c.legend(fontsize=8, title="shear rate")
    card_legend(a, models)
    figure.suptitle("Simple shear at constant volume, steady state")
    return save(figure, path)


def over_solid_fraction(panels, points: dict, models: dict[str, Law]) -> None:
    """Scaled pressure, scaled temperature and stress ratio, a colour per shear rate."""
    grains = next(iter(models.values())).grains
    rates = sorted({rate for rate, _ in points})
    nu_dem = np.array(sorted({nu for _, nu in points}))
    even = np.linspace(max(0.05, nu_dem[0] - 0.03), nu_dem[-1], 80)
    near = [model.nu_c + np.array([-3e-4, -1e-4, 0, 1e-4]) for model in models.values()]
    nu = np.unique(np.concatenate([even, *(one for one in near if np.isfinite(one).all())]))
    views = (
        (lambda s, r: s["pressure"] / (grains.density * (r * grains.diameter) ** 2), "log"),
        (lambda s, r: s["granular_temperature"] / (r * grains.diameter) ** 2, "log"),
        (lambda s, r: s["shear_stress"] / s["pressure"], "linear"),
    )
    for rate, colour in zip(rates, colours(len(rates))):
        for axes, (view, _) in zip(panels, views):
            at = [
                (fraction, mean_and_error([view(seed[0], rate) for seed in seeds]))
                for (r, fraction), seeds in points.items()
                if r == rate
            ]
            measured(axes, at, colour, f"{rate:g} /s")
            for model, style in zip(models.values(), line_styles(models).values()):
                axes.plot(nu, view(model.shear(nu, rate), rate), style, color=colour, linewidth=1.1)
    for axes, (_, scale) in zip(panels, views):
        axes.set(xlabel="solid fraction ν", yscale=scale)


def over_rate(axes, points: dict, models: dict[str, Law]) -> None:
    """Pressure, a colour per solid fraction."""
    rates = sorted({rate for rate, _ in points})
    fractions = sorted({nu for _, nu in points})
    span = np.geomspace(rates[0] / 2, rates[-1] * 2, 12)
    for fraction, colour in zip(fractions, colours(len(fractions), "plasma")):
        at = [
            (r, mean_and_error([seed[0]["pressure"] for seed in seeds]))
            for (r, f), seeds in points.items()
            if f == fraction
        ]
        measured(axes, at, colour, f"ν = {fraction:g}")
        for model, style in zip(models.values(), line_styles(models).values()):
            pressure = model.shear(np.full_like(span, fraction), span)["pressure"]
            axes.plot(span, pressure, style, color=colour, linewidth=1.1)


def measured(axes, at: Sequence[tuple], colour, label: str) -> None:
    """Points (x, (mean, error)) with their error bars."""
    axes.errorbar(
        [x for x, _ in at],
        [mean for _, (mean, _) in at],
        [error for _, (_, error) in at],
        fmt="o",
        markersize=4,
        color=colour,
        label=label,
    )


def remarks(case: Case, rows: Rows) -> list[str]:
    """How the cross-check between bumpy walls compares with this homogeneous shear."""
    walls = records.measured(Case(ROOT / "cases" / "bumpy_shear"))
    return cross_check.sentences(walls, rows, case.grains.density)


register(
    ComparedTest(
        "shear",
        order=1,
        keys=("solid_fraction", "shear_rate"),
        points=points,
        run=run,
        blocks=blocks,
        draw=draw,
        remarks=remarks,
    )
)
