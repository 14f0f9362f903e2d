"""The least model that does: climbs from cheap to dear until two rungs agree with the grains.

The rungs stand in cases/ladder.toml, or in a table [ladder] of cases/<case>/study.toml. They are
run four at a time, as far as the climb needs. Collapses are judged by their deposits and energies,
a chute by its steady flow. Written to --out: ladder.csv, grains.json, ladder.html and a figure.
"""

import sys

import pandas as pd

from cases import case, provenance
from cases.files import write_table
from cases.lookup import find_case
from cases.errors import CaseError
from cases.scenes import is_chute
from compare.chute.signature import STEADY_FLOW
from compare.study import ladder, page, reference, sweep
from compare.study.distance import cost
from compare.study.measure import COLLAPSE


def share(word: str) -> float:
    """5% or 0.05."""
    return float(word.rstrip("%")) / (100.0 if word.endswith("%") else 1.0)


def arguments(parser):
    parser.add_argument(
        "--tolerance",
        type=share,
        default=0.05,
        metavar="P%%",
        help="error that still counts as agreement (5%%)",
    )
    parser.add_argument(
        "--metric",
        choices=[*COLLAPSE.words, *STEADY_FLOW.words],
        help=f"error that is judged ({COLLAPSE.usual}; of a chute {STEADY_FLOW.usual})",
    )
    sweep.arguments(parser)
    reference.arguments(parser)


def run(options) -> int:
    from compare.study.charts import ladder as chart  # matplotlib takes its time to load

    if not 0.0 < options.tolerance < 1.0:
        raise CaseError(
            f"--tolerance {options.tolerance:g}: not a share between 0 and 1 (write 5% or 0.05)"
        )
    scene = case.load(find_case(options.case))
    by = STEADY_FLOW if is_chute(scene["geometry"]) else COLLAPSE
    metric = by.asked(options.metric)
    rungs = ladder.rungs(scene)
    with sweep.prepared(scene, options, "ladder", "ladder.html") as out:
        grains = reference.obtain(scene, options, by)
        if why := reference.unknown(grains, metric, by):
            raise CaseError(f"{why}, or choose another --metric")
        tried, stop = ladder.climb(
            rungs,
            lambda recipes: sweep.run_recipes(scene, recipes, options, by.point),
            lambda point: ladder.judge(point, grains, metric, options.tolerance, scene, by),
        )
        origin = provenance.about(provenance.typed("./grainpair", sys.argv[1:]))
        table = table_of(tried, stop, scene)
        words = ladder.paragraph(tried, stop, rungs, grains, by.words[metric], options.tolerance)
        write_table(
            out / "ladder.csv",
            provenance.head(
                origin,
                f"error in the {by.words[metric]} with the half-width of its 90 % interval "
                f"[-]; cost [s per sqrt(H/g)]; tolerance {options.tolerance:g}. {words}",
            ),
            table,
        )
        reference.write(grains, out / "grains.json", by)
        svg = chart.draw(tried, stop, by.words[metric], options.tolerance, out / "ladder")
        page.write(
            out / "ladder.html",
            f"The least model that does: {scene['title']}",
            origin,
            [("Rungs tried", [words], svg)],
            {"Rungs": table},
        )
        print(
            table.drop(columns=["message", "command"]).to_string(
                index=False, float_format=lambda x: f"{x:.3g}"
            )
        )
        print(words)
    return 0


def table_of(tried: list[dict], stop: int | None, scene: case.Case) -> pd.DataFrame:
    """A row for each rung that was tried."""
    return pd.DataFrame(
        [
            {
                "rung": one["rung"],
                "verdict": one["word"],
                "enough": i == stop,
                "error": one["verdict"].difference if one["verdict"] else float("nan"),
                "half_width": one["verdict"].half_width if one["verdict"] else float("nan"),
                "cost": cost(one["point"]) if one["verdict"] else float("nan"),
                "message": one["point"].get("message", ""),
                "command": one["recipe"].command(scene.path.parent),
            }
            for i, one in enumerate(tried)
        ]
    )
