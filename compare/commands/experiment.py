"""Columns of published aspect ratios, or slots of a silo: both engines beside what is published.

Aspect ratios or slots stand in the table [experiment] of cases/<case>/study.toml, what is published
in cases/published.toml. Every run is kept in runs/studies/points. Written to --out: experiment.csv,
experiment.html and the figure.
"""

import sys

from cases import case, provenance
from cases.files import write_table
from cases.lookup import find_case
from compare.study import experiment, page, published, recipe, sweep
from compare.study.deposit import definitions


def arguments(parser):
    sweep.arguments(parser)


def run(options) -> int:
    from compare.study.charts import experiment as chart  # matplotlib takes its time to load

    scene = case.load(find_case(options.case))
    columns = experiment.plan(scene, recipe.study(scene, "experiment"))
    others, figures = published.of(scene["geometry"]), definitions(scene)
    with sweep.prepared(scene, options, "experiment", "experiment.html") as out:
        tasks = [one.as_json() for column in columns for one in column.recipes]
        made = iter(sweep.run_tasks(scene, tasks, options, "compare.study.deposit"))
        found = [[next(made) for _ in column.recipes] for column in columns]
        table = experiment.table(scene, columns, found, others)

        origin = provenance.about(provenance.typed("./grainpair", sys.argv[1:]))
        write_table(
            out / "experiment.csv",
            provenance.head(
                origin,
                *([] if "discharge" in figures else ["lengths in L0"]),
                *(f"{name}: {words}" for name, words in figures.items()),
            ),
            table,
        )
        drawn = chart.draw(table, others, out / "experiment")
        page.write(
            out / "experiment.html",
            f"Beside what is published: {scene['title']}",
            origin,
            [
                (
                    " and ".join(name.replace("_", "-") for name in figures).capitalize(),
                    [
                        drawn.alt,
                        *(f"{name}: {words}." for name, words in figures.items()),
                        *(f"{one.name}: {one.source}." for one in others),
                    ],
                    drawn,
                )
            ],
            {"Every figure": table},
        )
        shown = [
            experiment.place_of(scene),
            "figure",
            "mpm",
            "numerical",
            "dem",
            "deviation",
            "verdict",
        ]
        shown += ["published_least", "published_most"]
        print(table[shown].to_string(index=False, float_format=lambda x: f"{x:.3g}"))
    return 0
