"""Compares the runs of a folder and writes the report: python3 -m compare.report RUNDIR.

RUNDIR holds mpm.h5 and dem.h5 (and, for an ensemble, more files mpm*.h5 and dem*.h5). Written
there: fields.h5, metrics.json, figures/*.svg and *.png, report.html.
"""

import io
import json
import shutil
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt

from compare.chute import report as chute
from compare.verdict import comparison, conclusion, controls, plain, siblings
from cases.style import STYLE
from compare.report import page as pages
from compare.report import player
from compare.report.charts import all_charts, seen
from cases import results
from cases.command_line import Parser
from cases.errors import CaseError
from cases.files import write_atomically
from cases.scenes import is_chute
from cases.scratch import scratch
from compare.mapping.runs import map_fields, open_run
from compare.report.width_study import study

# What a comparison writes into the folder of a run, and what it reads there.
OUTPUTS = ["fields.h5", "profiles.csv", "metrics.json", "figures", "report.html"]
INPUTS = ["mpm*.h5", "dem*.h5", "controls/*.h5", "siblings/*"]
HEADLINES = {
    "run_out_95": "Run-out, 95 % of the mass",
    "centre_of_mass_x": "Centre of mass, along x",
    "final_height": "Final height",
    "kinetic_energy_peak_time": "Time of the kinetic-energy peak",
    "kinetic_energy_peak": "Kinetic-energy peak",
    "dissipated_energy": "Energy dissipated",
    "unaccounted_energy": "Energy unaccounted for",
    "wasserstein_x": "Distance of the deposits along x",
    "moving_without_stress": "Moving without stress, continuum",
    "softening_error": "What softening may move",
    "cpu_seconds_engine": "Processor time of the engine's own steps",
}


@dataclass(frozen=True)
class Figure:
    name: str
    title: str
    sentence: str
    alt: str  # what is to be seen, with its numbers
    wide: str  # data URI
    narrow: str
    data: pages.Data
    tall: bool


def draw(chart, c, folder: Path) -> Figure | None:
    """Draws a chart for wide and narrow pages; the wide one also goes into `folder` as SVG
    and PNG. Its text and data are those of the wide one.
    """
    images, told = {}, {}
    with plt.rc_context(STYLE):
        for narrow in (False, True):
            drawn = chart.draw(c, narrow)
            if drawn is None:
                return None
            figure, sentence, *more = drawn
            figure.draw_without_rendering()  # lays out, once for all formats
            figure.set_layout_engine("none")
            svg = io.StringIO()
            figure.savefig(
                svg, format="svg", dpi=160, metadata={"Date": None, "Title": chart.title}
            )
            images[narrow] = "data:image/svg+xml;base64," + pages.encoded(svg.getvalue())
            if not narrow:
                (folder / f"{chart.name}.svg").write_text(svg.getvalue())
                figure.savefig(folder / f"{chart.name}.png", dpi=160)
                told = {
                    "sentence": sentence,
                    "alt": " ".join([*more, seen.words(figure)]),
                    "data": pages.data_of(seen.table(figure)),
                    "tall": pages.tall(figure),
                }
            plt.close(figure)
    return Figure(chart.name, chart.title, wide=images[False], narrow=images[True], **told)


def draw_all(charts, subject, folder: Path, tell) -> list[Figure]:
    """Draws charts into `folder`, which is made or replaced once all are there; tell(share of them
    drawn, text).
    """
    figures = []
    with scratch(folder.parent, folder.name) as work:
        for i, chart in enumerate(charts):
            tell(i / len(charts), f"figure: {chart.title.lower()}")
            figures.append(draw(chart, subject, work))
        shutil.rmtree(folder, ignore_errors=True)
        work.rename(folder)
    return [f for f in figures if f]


def provenance(runs) -> list[dict]:
    keys = (
        "engine",
        "engine_version",
        "commit",
        "seed",
        "date",
        "machine",
        "threads",
        "cpu_seconds",
        "cpu_seconds_engine",
        "wall_seconds",
        "end_reason",
        "command",
    )
    return [
        {"file": f"{run.name}.h5"} | {k: run.attributes.get(k, "") for k in keys} for run in runs
    ]


def page(template: str, runs, case, figures: list[Figure], contents=(), **values) -> str:
    """An HTML page of a template of this folder; it ends with the provenance of `runs` and the
    case. `contents`, (id, words), are what its list of headings has beside the figures.
    """
    return pages.render(
        pages.HERE / template,
        provenance=provenance(runs),
        case=case.resolved,
        figures=figures,
        contents=[
            *((one.name, one.title) for one in figures),
            *contents,
            ("provenance", "Provenance"),
        ],
        **values,
    )


def render(
    c,
    metrics: dict,
    figures: list[Figure],
    judged: list[controls.Control],
    mapping: dict,
) -> str:
    """The report."""
    case = c.mpm[0].case  # kept grains may stem from a case of another title and other margins
    return page(
        "report.html.j2",
        c.mpm + c.dem,
        case,
        figures,
        [("controls", "Negative controls"), ("metrics", "All metrics")],
        title=case.values.get("title", "Comparison"),
        paragraph=plain.paragraph(metrics),
        beyond=plain.beyond(metrics),
        player=player.build(c),
        verdict=metrics["verdict"],
        findings=metrics["findings"]["list"],
        verdict_words=conclusion.verdict_words,
        metrics=metrics,
        measured=[
            (name, entry)
            for name, entry in metrics.items()
            if name not in ("verdict", "findings") and not name.startswith("control_")
        ],
        metric_words=plain.WORDS,
        headlines=HEADLINES,
        controls=judged,
        control_words=controls.WORDS,
        mapping=mapping,
        counts={"mpm": len(c.mpm), "dem": len(c.dem)},
    )


def compare(folder: Path, options=(), tell=lambda fraction, text: None, widths=()) -> dict:
    """Everything from the HDF5 of the runs; returns the metrics. `options` go to grain_map;
    `widths` [d], when given, make a width study.
    """
    mpm, dem = comparison.run_files(folder)
    runs = [open_run(path) for path in [*mpm, *dem]]
    if any(is_chute(run.case["geometry"]) for run in runs):
        return chute.compare(folder, mpm, dem, options, tell)
    comparison.refuse_unpaired(runs)
    tell(0.0, "mapping both clouds onto one grid")
    beside = [*controls.files(folder), *siblings.files(folder)]
    map_fields([*mpm, *dem, *beside], folder / "fields.h5", *options)
    tell(0.3, "metrics")
    c = comparison.load(folder)
    judged = controls.judge_all(c, folder)
    metrics = conclusion.conclude(c, judged)
    if widths:
        tell(0.35, "width study")
        c.width_study = study(c.dem[0], dem[0], widths, options)
    write_atomically(folder / "metrics.json", json.dumps(metrics, indent=1) + "\n")

    figures = draw_all(
        all_charts(), c, folder / "figures", lambda share, text: tell(0.4 + 0.55 * share, text)
    )
    mapping = c.dem[0].fields.attributes
    write_atomically(folder / "report.html", render(c, metrics, figures, judged, mapping))
    tell(1.0, "report written")
    return metrics


def main(words: list[str]) -> int:
    parser = Parser(prog="compare.report", description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder that holds mpm.h5 and dem.h5")
    parser.add_argument("--progress", action="store_true", help="print progress lines")
    options = parser.parse_args(words)
    tell = (
        (lambda fraction, text: print(f"progress {fraction:.2f} {text}", flush=True))
        if options.progress
        else (lambda fraction, text: None)
    )
    if not options.folder.is_dir():
        raise CaseError(f"{options.folder}: no folder of a run")
    with results.owned(options.folder) as owned, owned.prepare(OUTPUTS, INPUTS) as work:
        compare(work, tell=tell)
    return 0
