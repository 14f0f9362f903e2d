"""A column's collapse as [Ceccato2019, section 4] shows it, from one run of the continuum:
statements, figures, page.
"""

import json
from pathlib import Path

from compare.report import report
from compare.report.charts import all_charts
from cases.errors import CaseError
from cases.files import write_atomically
from cases.scenes import refuse_chute
from compare.metrics.final_height import final_height
from compare.metrics.run_out import run_out
from compare.mapping.clouds import POINT_STATE
from compare.mapping.runs import Run, map_fields, open_fields, open_run
from compare.verdict.statements import judge

LOSSES = {
    "loss_transfer": "between points and grid",
    "loss_time_integration": "by the finite step",
    "loss_mixing": "where void ratios mix",
    "loss_detached": "by points that detached",
    "loss_conduction": "where conduction asks for more than is held",
}


def open_collapse(path: Path) -> Run:
    """The run of an mpm.h5, its energies measured in what it releases. Raises CaseError when it is
    not one of the continuum.
    """
    run = open_run(path)
    if run.engine != "mpm" or run.case["geometry.dimension"] == "axisymmetric":
        raise CaseError(
            f"{path}: not a slab of the continuum ({run.engine}, {run.case['geometry.dimension']}) "
            "give the mpm.h5 of a column in plane strain or in three dimensions"
        )
    refuse_chute(run.case, "statements are")
    lacking = [name for name in POINT_STATE if name not in run.clouds[0].state]
    if lacking:
        raise CaseError(
            f"{path}: the points lack {', '.join(lacking)} (an old file?) run the case again"
        )
    if len(run.time) < 3 or run.released() <= 0.0:
        raise CaseError(
            f"{path}: no collapse ({len(run.time)} frames, {run.released():.3g} J released)"
        )
    run.reference_energy = run.released()
    return run


def make(path: Path, folder: Path, tell=lambda fraction, text: None) -> dict:
    """Writes fields.h5, statements.json, figures/ and collapse.html into `folder`; returns the
    statements.
    """
    run = open_collapse(path)
    folder.mkdir(parents=True, exist_ok=True)
    tell(0.0, "mapping the points")
    map_fields(
        [path], folder / "fields.h5", "--width", run.case["mpm.cell_size"] / run.diameter
    )  # points drawn apart leave no gaps
    run.mapped = open_fields(folder / "fields.h5", run.name)
    tell(0.1, "statements")
    statements = judge(run)
    write_atomically(
        folder / "statements.json", json.dumps(statements, indent=1, ensure_ascii=False) + "\n"
    )
    figures = report.draw_all(
        all_charts("compare.report.charts.collapse"),
        run,
        folder / "figures",
        lambda share, text: tell(0.3 + 0.7 * share, text),
    )
    losses = {name: float(run.normalised(name)[-1]) for name in ("unaccounted", *LOSSES)}
    write_atomically(
        folder / "collapse.html",
        report.page(
            "collapse.html.j2",
            [run],
            run.case,
            figures,
            [("definitions", "How each statement is measured")],
            title=run.case.values.get("title", "Collapse"),
            statements=statements,
            loss_words=LOSSES,
            held=sum(s["verdict"] == "holds" for s in statements.values()),
            losses=losses,
            run_out=run_out(run),
            height=final_height(run),
            released=run.released(),
            end=float(run.tau()[-1]),
            rest=run.attributes.get("end_reason") == "rest",
            warnings=run.attributes.get("warnings", "none"),
        ),
    )
    tell(1.0, "page written")
    return statements
