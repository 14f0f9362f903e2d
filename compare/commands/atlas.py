"""The stability map of a case: where each method fails, its limit, and failures known by name.

The table [atlas] of cases/<case>/study.toml holds the planes, the named failures and the trends. In
each row of a plane the boundary is found by bisection; detectors in the solver
(mpm/step/watch.hpp) tell how a run failed. Written to --out: boundaries.csv, failures.csv,
trends.csv, atlas.html and figures.
"""

import sys
from pathlib import Path

from cases import case, provenance
from cases.files import write_table
from cases.lookup import find_case
from compare.study import atlas, page, recipe, sweep


def arguments(parser):
    sweep.arguments(parser)


def run(options) -> int:
    scene = case.load(find_case(options.case))
    study = recipe.study(scene, "atlas")
    timeout, planes = study["timeout"], study.get("plane", [])
    failures, trends = study.get("failure", []), study.get("trend", [])

    with sweep.prepared(scene, options, "atlas", "atlas.html") as out:
        asked = [atlas.rows_of(plane, timeout) for plane in planes]
        tasks = [task for one in asked for _, task in one]
        done = iter(sweep.run_tasks(scene, tasks, options, "compare.study.boundary"))
        rows = [[(value, next(done)) for value, _ in one] for one in asked]

        pairs = [atlas.recipes_of(failure, timeout) for failure in failures]
        series = [atlas.trend_recipes(trend, timeout) for trend in trends]
        recipes = [one for group in [*pairs, *series] for one in group]
        points = iter(sweep.run_recipes(scene, recipes, options))
        shown = [(next(points), next(points)) for _ in pairs]
        trended = [[next(points) for _ in group] for group in series]

        told = Told(scene, out, provenance.about(provenance.typed("./grainpair", sys.argv[1:])))
        if planes:
            told.planes(planes, rows)
        if failures:
            told.failures(failures, shown)
        if trends:
            told.trends(trends, trended)
        page.write(
            out / "atlas.html",
            f"Stability: {scene['title']}",
            told.origin,
            told.figures,
            told.tables,
        )
    return 0


class Told:
    """What the map says so far: tables and figures, written to `out` and gathered for the page."""

    def __init__(self, scene: case.Case, out: Path, origin: dict):
        self.scene, self.out, self.origin = scene, out, origin
        self.tables: dict = {}
        self.figures: list = []

    def keep(self, heading: str, name: str, table, note: str):
        self.tables[heading] = table
        write_table(self.out / name, provenance.head(self.origin, note), table)

    def planes(self, planes: list[dict], rows: list):
        from compare.study.charts import atlas as chart  # matplotlib takes its time to load

        self.keep(
            "Every run of the planes",
            "boundaries.csv",
            atlas.table(planes, rows, self.scene),
            "a row is one run; times_default and times_limit: "
            "boundary over the default and over the claimed limit",
        )
        words = [
            f"{plane['name']}: {'; '.join(atlas.sentences(plane, found, self.scene))}"
            for plane, found in zip(planes, rows)
        ]
        drawn = chart.draw(planes, rows, self.scene, self.out / "atlas")
        self.figures.append(("Planes", words, drawn))
        print(*words, sep="\n")

    def failures(self, failures: list[dict], shown: list):
        named = atlas.failure_table(failures, shown, self.scene)
        note = "each failure with the recipe that shows it"
        self.keep("Failures known by name", "failures.csv", named, note)
        for _, row in named.iterrows():
            there = "reproduced" if row["reproduced"] else "NOT REPRODUCED"
            gone = "absent" if row["absent_at_defaults"] else "PRESENT"
            print(f"{row['failure']}: {there}, {gone} at the defaults: {row['detected']}")

    def trends(self, trends: list[dict], trended: list):
        from compare.study.charts import atlas as chart

        heading = "Damping as the step shrinks"
        measured = atlas.trend_table(trends, trended, self.scene)
        self.keep(
            heading,
            "trends.csv",
            measured,
            "damping: energy lost to the numerics over the time integral of kinetic energy",
        )
        self.figures.append((heading, [], chart.draw_trends(measured, self.out / "damping")))
        print(measured.drop(columns="command").to_string(index=False))
