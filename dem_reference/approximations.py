"""What softer and coarser grains cost in accuracy and save in time.

    python3 -m dem_reference.approximations [-o CHART.png]

From the tables of their ensembles.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from cases import command_line
from cases.errors import exit_code
from cases.files import check_figure, write_figure
from cases.style import STYLE

CASES = Path(__file__).resolve().parents[1] / "cases"
SERIES = {  # label -> table, the first of each being what the others are measured against
    "softer, 334 grains (column_ci)": {
        "E": "column_ci/softening_3e8",
        "E / 10": "column_ci/softening_3e7",
        "E / 100": "column_ci/softening_3e6",
    },
    "coarser, 7000 grains (column_small, 10 d thick)": {
        "d": "column_small/wide_periodic",
        "2 d": "column_small/coarsening_2",
        "4 d": "column_small/coarsening_4",
    },
}
MEASURES = {
    "run_out_99": "run-out, 99 % of mass",
    "highest_grain_at_wall": "highest grain at the wall",
    "kinetic_energy_peak": "kinetic-energy peak",
}


def deviations(tables: dict[str, pd.DataFrame]) -> pd.DataFrame:
    """Of each table's mean from the first table's, with its standard error.

    Both over the latter [%]. And the CPU seconds per run.

    A table of one seed borrows the next one's standard deviation, as the scatter of packings is all
    there is to go by. A run-out is counted from the wall, so that the deviation is one of length.
    """
    rows, names = [], list(tables)
    for name in names:
        row = {
            "name": name,
            "seeds": len(tables[name]),
            "cpu_seconds": tables[name]["cpu_seconds"].mean(),
        }
        for measure in MEASURES:
            offset = 1.0 if measure.startswith("run_out") else 0.0
            mean = {n: tables[n][measure].mean() + offset for n in names}
            error = {
                n: next(
                    tables[m][measure].std(ddof=1)
                    for m in names[names.index(n) :]
                    if len(tables[m]) > 1
                )
                / np.sqrt(len(tables[n]))
                for n in names
            }
            first = names[0]
            row[measure] = 100 * (mean[name] / mean[first] - 1)
            row[f"{measure}_error"] = (
                100 * np.hypot(error[name], error[first] if name != first else 0.0) / mean[first]
            )
        rows.append(row)
    return pd.DataFrame(rows)


def draw(series: dict[str, pd.DataFrame]):
    with plt.rc_context(STYLE):
        figure, panels = plt.subplots(
            1, len(series), figsize=(9, 3.8), sharey=True, layout="constrained"
        )
        for axes, (title, table) in zip(panels, series.items()):
            for k, (measure, label) in enumerate(MEASURES.items()):
                axes.errorbar(
                    table["cpu_seconds"] * 1.04 ** (k - 1),
                    table[measure],
                    table[f"{measure}_error"],
                    fmt="osD"[k],
                    capsize=3,
                    label=label,
                )
            for name, x in zip(table["name"], table["cpu_seconds"]):
                axes.annotate(
                    name,
                    (x, 1.0),
                    xycoords=("data", "axes fraction"),
                    xytext=(0, -12),
                    textcoords="offset points",
                    ha="center",
                )
            axes.axhline(0, lw=0.8, color="0.5", zorder=0)
            axes.set(
                xscale="log",
                title=title,
                xlabel="processor time of packing, collapse and audit [s]",
            )
            axes.set_xticks(
                table["cpu_seconds"],
                [f"{x:.2g}" if x < 100 else f"{x:.0f}" for x in table["cpu_seconds"]],
            )
            axes.minorticks_off()
            axes.margins(x=0.15)
        panels[0].set_ylabel("deviation from the finest [%]")
        panels[-1].legend(loc="lower right", fontsize="small")
        low, high = panels[0].get_ylim()
        panels[0].set_ylim(low, high + 0.12 * (high - low))
    return figure


def main() -> int:
    parser = command_line.Parser(
        prog="dem_reference.approximations", description=__doc__.split("\n")[0]
    )
    parser.add_argument("-o", "--output", type=Path, help="chart")
    options = parser.parse_args()
    if options.output:
        check_figure(options.output)
    series = {}
    for title, names in SERIES.items():
        tables = {
            name: pd.read_csv(
                (CASES / path).parent / "reference" / f"{Path(path).name}.csv", comment="#"
            )
            for name, path in names.items()
        }
        series[title] = deviations(tables)
        print(
            title,
            series[title].to_string(index=False, float_format=lambda value: f"{value:.3g}"),
            sep="\n",
        )
    if options.output:
        write_figure(options.output, draw(series), dpi=160)
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(main))
