"""Does the numerical error bar of a report cover the error?

Scenes stand in the table [error_bar] of cases/<case>/study.toml: each is run, with the two siblings
that its bar is told from, and on cells so fine that they stand for the exact solution. Every result
is kept in runs/studies/points. Written to --out: error_bar.csv.
"""

import sys

from cases import case, provenance
from cases.files import write_table
from cases.lookup import find_case
from compare.study import error_bar, recipe, sweep


def arguments(parser):
    sweep.arguments(parser)


def run(options) -> int:
    scene = case.load(find_case(options.case))
    study = recipe.study(scene, "error_bar")
    tasks = []
    for one in study["scene"]:
        sets = tuple(recipe.assignment(key, value) for key, value in one.get("set", {}).items())
        asked = recipe.Recipe("mpm", sets, one["name"], study["timeout"])
        tasks.append({"recipe": asked.as_json(), "fine": one["fine"]})
    with sweep.prepared(scene, options, "error_bar", "error_bar.csv") as out:
        found = sweep.run_tasks(scene, tasks, options, "compare.study.error_bar")
        table = error_bar.table([one["name"] for one in study["scene"]], found)
        head = provenance.head(
            provenance.about(provenance.typed("./grainpair", sys.argv[1:])),
            "main, fine, coarse, slow, error, bar in the metric's unit (compare/metrics); covered: "
            "|error| <= bar",
        )
        write_table(out / "error_bar.csv", head, table)
    print(table.to_string(index=False, float_format=lambda x: f"{x:.3g}"))
    for name, covered in table.groupby("scene", sort=False)["covered"]:
        print(f"{name}: {covered.sum()} of {len(covered)} covered ({covered.mean():.0%})")
    return 0
