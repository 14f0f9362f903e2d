"""A trial of laws as a table, figures and one HTML file."""

from pathlib import Path

import pandas as pd

from cases import provenance
from cases.files import write_table
from cases.scenes import is_chute
from compare.judge import trial as judged
from compare.judge.charts import NAME, depth, friction, ratio_maps, temperature
from compare.judge.charts import outcome as outcome_chart
from compare.judge.outcome import regression
from compare.judge.trial import Control, Trial
from compare.study import page

UNITS = (
    "ratio: law over grains (of void_ratio the difference), mean over packings and widths; low, "
    "high: the range; work: share of the work done in all that flows [-]; grains, value: means [SI]"
)

OUTCOME = (
    "bias of mu_D; deviations, each relative: run_out_95 to the final length; errors as frontier "
    "has them; cheaper: times, than the grains [-]"
)
FORETOLD = (
    "deviation = at no bias + slope * bias; explained: share of the variance; left, foretold, by "
    "the mean: root mean squares of what the line leaves, of scenes foretold by a line through the "
    "others, and by the mean of the others (the control)"
)


def write(
    trial: Trial,
    controls: list[Control],
    outcome: pd.DataFrame | None,
    folder: Path,
    command: str,
) -> pd.DataFrame:
    """Writes judge.csv, overall.csv, figures and judge.html, with `outcome` (of
    compare/judge/outcome.py) outcome.csv and foretold.csv; returns the overall table.
    """
    about = provenance.about(command)
    table = judged.overall(trial)
    write_table(folder / "judge.csv", provenance.head(about, UNITS), trial.table, "%.5g")
    notes = [
        f"{one.name}: {'told apart' if one.rejected else 'NOT told apart'}; {one.words}"
        for one in controls
    ]
    write_table(folder / "overall.csv", provenance.head(about, UNITS, *notes), table, "%.4g")
    figures = [
        friction.draw(trial, folder / "friction"),
        depth.draw(trial, folder / "depth")
        if is_chute(trial.scene["geometry"])
        else ratio_maps.draw(trial, folder / "ratio_maps"),
    ]
    if any(law.held is not None for law in trial.laws):
        figures.insert(1, temperature.draw(trial, folder / "temperature"))
    widths = ", ".join(f"{cells.width:.3g} d" for cells in trial.runs[0])
    files = len(trial.files)
    first, words, drawn = figures[0]
    made_of = (
        f"{NAME[trial.engine].capitalize()}: {files} run{'s' if files > 1 else ''}, kernel widths "
        f"{widths}. Controls: {'; '.join(notes)}."
    )
    figures[0] = first, [made_of, *words], drawn
    tables = {
        "Bias of each law": table[[*table.columns[1:], table.columns[0]]],
        "Refused": pd.DataFrame({"what, and why": trial.refused}),
    }
    if outcome is not None:
        told = regression(outcome)
        write_table(folder / "outcome.csv", provenance.head(about, OUTCOME), outcome, "%.4g")
        write_table(folder / "foretold.csv", provenance.head(about, FORETOLD), told, "%.4g")
        figures.append(outcome_chart.draw(outcome, folder / "outcome"))
        tables |= {
            "Bias against outcome, law by law": outcome[[*outcome.columns[2:], "scene", "law"]],
            "Foretold from the bias": told[[*told.columns[1:], "headline"]],
        }
    page.write(
        folder / "judge.html",
        f"Laws in the flow of the {'grains' if trial.engine == 'dem' else 'continuum'}: "
        f"{trial.scene['title']}",
        about,
        figures,
        tables,
    )
    return table
