"""Speed against accuracy: every recipe of a case's study, against the grains and the law's limit.

The grains are the mean of an ensemble, the limit is the law's solution on a fine grid. The recipes
stand in the table [frontier] of cases/<case>/study.toml. Each is run once and kept in
runs/studies/points, under a key of what decides it (compare/study/keys.py); a run that fails is a
point too. Written to --out: points.csv, grains.json (the grains' mean and scatter), figures, and
frontier.html, where each point tells its recipe and command.
"""

import sys
from pathlib import Path

from cases import case, provenance
from cases.files import write_table
from cases.lookup import find_case
from compare.study import frontier, page, recipe, reference, sweep
from compare.study.distance import WORDS


def arguments(parser):
    parser.add_argument("--metric", choices=list(WORDS), help="draw this error only (all)")
    sweep.arguments(parser)
    reference.arguments(parser)


COLUMNS = (
    "key",
    "engine",
    "series",
    "label",
    "status",
    "cost",
    *(f"error_{name}" for name in WORDS),
    "moving_without_stress",
    "message",
    "command",
)


def run(options) -> int:
    scene = case.load(find_case(options.case))
    study = recipe.study(scene, "frontier")
    recipes, fine = (
        recipe.unique(
            [
                one
                for series in study.get(name, [])
                for one in recipe.expand(series, study["timeout"])
            ]
        )
        for name in ("series", "fine")
    )
    with sweep.prepared(scene, options, "frontier", "frontier.html") as out:
        grains = reference.obtain(scene, options)
        found = sweep.run_recipes(scene, recipes + fine, options)
        points = frontier.table(found[: len(recipes)], found[len(recipes) :], grains, scene)
        origin = provenance.about(provenance.typed("./grainpair", sys.argv[1:]))
        head = provenance.head(
            origin,
            "cost [s per sqrt(H/g)]; errors [-]; cell_size [m]; velocity_relaxation [sqrt(H/g)]; "
            "young_modulus [Pa]; a row is one run of `command`",
        )
        write_table(out / "points.csv", head, points)
        reference.write(grains, out / "grains.json")
        names = [options.metric] if options.metric else list(WORDS)
        page.write(
            out / "frontier.html",
            f"Speed against accuracy: {scene['title']}",
            origin,
            [one for name in names for one in figures_of(name, points, grains, bool(fine), out)],
            {"Every point": points[list(COLUMNS)].sort_values("cost")},
        )
    return 0


def figures_of(name: str, points, grains: dict, fine: bool, out: Path) -> list[page.Figure]:
    """The figures of one metric, for the page: against the grains and, where there are solutions on
    a `fine` grid, against those; says what they say. Where the grains do not tell, why.
    """
    from compare.study.charts import frontier as chart  # matplotlib takes its time to load

    if why := reference.unknown(grains, name):
        print(why)
        return [(f"Error from the grains: {WORDS[name]}", [why], None)]
    words = frontier.sentences(points, grains, name)
    drawn = chart.draw(points, grains, name, out / f"frontier_{name}")
    figures: list[page.Figure] = [(f"Error from the grains: {WORDS[name]}", words, drawn)]
    scatter = frontier.band(grains, name)
    print(f"{WORDS[name]} (scatter of the seeds {scatter:.1%})", *words, sep="\n  ")
    if fine and points[f"numerical_{name}"].notna().any():
        drawn = chart.draw_numerical(points, name, out / f"numerical_{name}")
        figures.append((f"Numerical error alone: {WORDS[name]}", [], drawn))
    return figures
