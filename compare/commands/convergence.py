"""Do the numerics decide the result? The continuum on other cells, points and steps.

Run-out, height and losses, with their scatter. The settings stand in the table [convergence] of
cases/<case>/study.toml. Every run is kept in runs/studies/points. Written to --out:
convergence.csv, convergence.html and the figure.
"""

import sys

from cases import case, provenance
from cases.files import write_table
from cases.lookup import find_case
from compare.study import convergence, page, recipe, sweep


def arguments(parser):
    sweep.arguments(parser)


def run(options) -> int:
    from compare.study.charts import convergence as chart  # matplotlib takes its time to load

    scene = case.load(find_case(options.case))
    settings = convergence.plan(recipe.study(scene, "convergence"))
    with sweep.prepared(scene, options, "convergence", "convergence.html") as out:
        tasks = [one.as_json() for setting in settings for one in setting["recipes"]]
        made = iter(sweep.run_tasks(scene, tasks, options, "compare.study.figures"))
        found = [[next(made) for _ in setting["recipes"]] for setting in settings]
        table = convergence.table(settings, found)

        origin = provenance.about(provenance.typed("./grainpair", sys.argv[1:]))
        head = provenance.head(
            origin,
            "figures: compare/study/figures.py; change: of the mean, relative to the group's base, "
            "with the half-width of its 90 % interval",
        )
        write_table(out / "convergence.csv", head, table)
        drawn = chart.draw(table, out / "convergence")
        judged = table[table["verdict"].notna()].drop(columns=["settings", "runs"])
        page.write(
            out / "convergence.html",
            f"Do the numerics decide the result? {scene['title']}",
            origin,
            [("Changes of the numerics", [drawn.alt], drawn)],
            {"Figures with a limit": judged, "Every figure": table},
        )
        print(judged.to_string(index=False, float_format=lambda x: f"{x:.3g}"))
    return 0
