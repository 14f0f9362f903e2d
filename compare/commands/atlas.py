"""The stability map of a case: where each method fails, against the limit it claims, and the
failures known by name.

The table [atlas] of cases/<case>/study.toml holds the planes, the named failures and the trends. In
each row of a plane the boundary is found by bisection; detectors in the solver (mpm/step/watch.hpp)
tell how a run failed. Written to --out: boundaries.csv, failures.csv, trends.csv, atlas.html and
figures.
"""

import sys
from dataclasses import dataclass, field
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
    scene = case.load(find_case(options.case))
    study = recipe.study(scene, "atlas")
    timeout, planes = study["timeout"], study.get("plane", [])
    failures, trends = study.get("failure", []), study.get("trend", [])

    asked = [atlas.rows_of(plane, timeout) for plane in planes]
    tasks = [task for one in asked for _, task in one]
    done = iter(sweep.run_tasks(scene, tasks, options, "compare.study.boundary"))
    rows = [[(value, next(done)) for value, _ in one] for one in asked]

    pairs = [atlas.recipes_of(failure, timeout) for failure in failures]
    series = [steps_of(trend, timeout) for trend in trends]
    points = iter(
        sweep.run_recipes(scene, [one for group in [*pairs, *series] for one in group], options)
    )
    shown = [(next(points), next(points)) for _ in pairs]
    trended = [[next(points) for _ in group] for group in series]

    found = Found(
        scene,
        options.out or Path("runs") / "studies" / name_of(scene.path) / "atlas",
        provenance.about(" ".join(["./grainpair", *sys.argv[1:]])),
    )
    if planes:
        tell_planes(found, planes, rows)
    if failures:
        tell_failures(found, failures, shown)
    if trends:
        tell_trends(found, trends, trended)
    html, title = found.out / "atlas.html", f"Stability: {scene['title']}"
    page.write(html, title, found.origin, found.figures, found.tables)
    print(html)
    return 0


def steps_of(trend: dict, timeout: float) -> list[recipe.Recipe]:
    """The runs of a trend: one per value of what it goes along."""
    fixed = [recipe.assignment(*item) for item in trend["set"].items()]
    return [
        recipe.Recipe(
            "mpm",
            (*fixed, recipe.assignment(trend["along"], value)),
            trend["name"],
            timeout,
        )
        for value in trend["values"]
    ]


@dataclass
class Found:
    """What the page will show, and the folder that its tables and figures are kept in."""

    scene: case.Case
    out: Path
    origin: dict[str, str]
    tables: dict = field(default_factory=dict)
    figures: list = field(default_factory=list)

    def keep(self, title: str, file: str, table, note: str):
        self.tables[title] = table
        write_table(self.out / file, provenance.head(self.origin, note), table)


def tell_planes(found: Found, planes: list[dict], rows: list):
    from compare.study.charts import atlas as chart  # matplotlib takes its time to load

    found.keep(
        "Every run of the planes",
        "boundaries.csv",
        atlas.table(planes, rows, found.scene),
        "a row is one run; times_default and times_limit: boundary over the default and over the "
        "claimed limit",
    )
    words = [
        f"{plane['name']}: {sentence}"
        for plane, row in zip(planes, rows)
        for sentence in atlas.sentences(plane, row, found.scene)
    ]
    drawn = chart.draw(planes, rows, found.scene, found.out / "atlas")
    found.figures.append(("Planes", words, drawn))
    print(*words, sep="\n")


def tell_failures(found: Found, failures: list[dict], shown: list):
    named = atlas.failure_table(failures, shown, found.scene)
    found.keep(
        "Failures known by name",
        "failures.csv",
        named,
        "each failure with the recipe that shows it",
    )
    for _, row in named.iterrows():
        print(
            f"{row['failure']}: {'reproduced' if row['reproduced'] else 'NOT REPRODUCED'}, "
            f"{'absent' if row['absent_at_defaults'] else 'PRESENT'} at the defaults: "
            f"{row['detected']}"
        )


def tell_trends(found: Found, trends: list[dict], trended: list):
    from compare.study.charts import atlas as chart  # matplotlib takes its time to load

    title = "Damping as the step shrinks"
    measured = atlas.trend_table(trends, trended, found.scene)
    found.keep(
        title,
        "trends.csv",
        measured,
        "damping: energy lost to the numerics over the time integral of kinetic energy",
    )
    found.figures.append((title, [], chart.draw_trends(measured, found.out / "damping")))
    print(measured.drop(columns="command").to_string(index=False))
