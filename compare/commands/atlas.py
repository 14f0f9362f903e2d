"""The stability map of a case: where each method fails, against the limit it claims, and the failures known by name.

The table [atlas] of cases/<case>/study.toml holds the planes, the named failures and the trends. In each row of a plane the
boundary is found by bisection; detectors in the solver (mpm/step/watch.hpp) tell how a run failed. Written to --out:
boundaries.csv, failures.csv, trends.csv, atlas.html and figures.
"""

import sys
from pathlib import Path

from cases import case, provenance
from cases.files import write_table
from cases.programs import name_of
from compare.commands.run import find_case
from compare.study import atlas, page, recipe, sweep


def arguments(parser):
    parser.add_argument(
        "case",
        metavar="CASE",
        help="case file, folder that holds case.toml, or name of a folder in cases/",
    )
    sweep.arguments(parser)


def run(options) -> int:
    from compare.study.charts import atlas as chart  # matplotlib takes its time to load

    scene = case.load(find_case(options.case))
    study = recipe.study(scene, "atlas")
    timeout, planes = study["timeout"], study.get("plane", [])
    failures, trends = study.get("failure", []), study.get("trend", [])

    asked = [atlas.rows_of(plane, timeout) for plane in planes]
    tasks = [task for one in asked for _, task in one]
    done = iter(sweep.run_tasks(scene, tasks, options, "compare.study.boundary"))
    rows = [[(value, next(done)) for value, _ in one] for one in asked]

    pairs = [atlas.recipes_of(failure, timeout) for failure in failures]
    series = [
        [
            recipe.Recipe(
                "mpm",
                (
                    *(recipe.assignment(*item) for item in trend["set"].items()),
                    recipe.assignment(trend["along"], value),
                ),
                trend["name"],
                timeout,
            )
            for value in trend["values"]
        ]
        for trend in trends
    ]
    points = iter(
        sweep.run_recipes(scene, [one for group in [*pairs, *series] for one in group], options)
    )
    shown = [(next(points), next(points)) for _ in pairs]
    trended = [[next(points) for _ in group] for group in series]

    out = options.out or Path("runs") / "studies" / name_of(scene.path) / "atlas"
    origin = provenance.about(" ".join(["./grainpair", *sys.argv[1:]]))
    tables, figures = {}, []
    if planes:
        tables["Every run of the planes"] = atlas.table(planes, rows, scene)
        write_table(
            out / "boundaries.csv",
            provenance.head(
                origin,
                "a row is one run; times_default and times_limit: "
                "boundary over the default and over the claimed limit",
            ),
            tables["Every run of the planes"],
        )
        words = [
            f"{plane['name']}: {sentence}"
            for plane, found in zip(planes, rows)
            for sentence in atlas.sentences(plane, found, scene)
        ]
        figures.append(("Planes", words, chart.draw(planes, rows, scene, out / "atlas")))
        print(*words, sep="\n")
    if failures:
        tables["Failures known by name"] = named = atlas.failure_table(failures, shown, scene)
        write_table(
            out / "failures.csv",
            provenance.head(origin, "each failure with the recipe that shows it"),
            named,
        )
        for _, row in named.iterrows():
            print(
                f"{row['failure']}: {'reproduced' if row['reproduced'] else 'NOT REPRODUCED'}, "
                f"{'absent' if row['absent_at_defaults'] else 'PRESENT'} at the defaults: {row['detected']}"
            )
    if trends:
        tables["Damping as the step shrinks"] = measured = atlas.trend_table(trends, trended, scene)
        write_table(
            out / "trends.csv",
            provenance.head(
                origin,
                "damping: energy lost to the numerics over the time integral of kinetic energy",
            ),
            measured,
        )
        figures.append(
            ("Damping as the step shrinks", [], chart.draw_trends(measured, out / "damping"))
        )
        print(measured.drop(columns="command").to_string(index=False))
    page.write(out / "atlas.html", f"Stability: {scene['title']}", origin, figures, tables)
    print(out / "atlas.html")
    return 0
