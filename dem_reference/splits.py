"""Both splits of the grains' dissipation over time, with their scatter over packings.

    python3 -m dem_reference.splits DEM.h5... [-o TABLE.csv] [--chart CHART.png]

By direction: normal damping, and friction with tangential damping. By lifetime: contacts shorter
than a threshold in binary contact times count as collisions, for the case's threshold and for half,
twice and four times it.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from cases import command_line, reading
from cases.case import parse
from cases.style import STYLE
from cases.errors import CaseError, exit_code
from cases.files import check_figure, check_table, write_figure
from cases.provenance import typed

from .ensemble import save

ENERGIES = ("time", "potential", "dissipated_normal", "dissipated_tangential", "dissipated")
STEP = 0.1  # between rows of the table [sqrt(H/g)]


def shares(path: Path) -> pd.DataFrame:
    """Dissipated so far over the energy released in the end, one column per part.

    At multiples of STEP [sqrt(H/g)].
    Thresholds that the sampling interval does not resolve are left out: every contact seen once is
    older.
    """
    with reading.result(path) as file:
        if "lifetime" not in file:
            raise CaseError(
                f"{path}: no split of the dissipation (dem.audit_interval = 0, or a plain script)"
            )
        threshold = parse(reading.attributes(file)["case_resolved"], path)["dem.lifetime_threshold"]
        accounts = reading.group(file, "energy")
        rolling = [name for name in ("dissipated_rolling",) if name in accounts]
        energy = reading.columns(accounts, (*ENERGIES, *rolling))
        lifetime = reading.group(file, "lifetime")
        enduring, multiples = lifetime["dissipated_enduring"][()], lifetime["multiples"][()]
        if enduring.shape != (len(energy["time"]), len(multiples)):
            raise CaseError(f"{path}: lifetime/dissipated_enduring is of shape {enduring.shape}")
        youngest = reading.number(lifetime, "interval") / reading.number(lifetime, "unit_time")
        time = energy["time"] / reading.number(file, "time_scale")
    released = energy["potential"][0] - energy["potential"][-1]
    contacts = energy["dissipated_normal"] + energy["dissipated_tangential"]
    if "dissipated_rolling" in energy:
        contacts = contacts + energy["dissipated_rolling"]
    parts = {
        "normal": energy["dissipated_normal"],
        "tangential": energy["dissipated_tangential"],
        **({"rolling": energy["dissipated_rolling"]} if rolling else {}),
        "total": energy["dissipated"],
    }
    parts |= {
        f"short_{threshold * m:g}": contacts - enduring[:, k]
        for k, m in enumerate(multiples)
        if threshold * m >= youngest
    }
    at = np.arange(0, time[-1] + 1e-9, STEP)
    return pd.DataFrame(
        {"time": at}
        | {name: np.interp(at, time, values / released) for name, values in parts.items()}
    )


def table(paths: list[Path]) -> pd.DataFrame:
    """Mean of each part and its standard deviation (`…_deviation`) over the runs.

    To the end of the shortest.
    """
    runs = [shares(path) for path in paths]
    rows = min(len(run) for run in runs)
    stack = np.stack([run.iloc[:rows].to_numpy() for run in runs])
    out = pd.DataFrame(stack.mean(axis=0), columns=runs[0].columns)
    if len(runs) > 1:
        for k, name in enumerate(runs[0].columns[1:], start=1):
            out[f"{name}_deviation"] = stack[:, :, k].std(axis=0, ddof=1)
    return out


def draw(found: pd.DataFrame):
    thresholds = [
        name for name in found if name.startswith("short_") and not name.endswith("deviation")
    ]
    with plt.rc_context(STYLE):
        figure, (left, right) = plt.subplots(
            1, 2, figsize=(9.5, 3.8), sharey=True, layout="constrained"
        )

        def line(axes, name, label, colour, **style):
            axes.plot(found["time"], found[name], color=colour, label=label, **style)
            if f"{name}_deviation" in found:
                spread = found[f"{name}_deviation"]
                axes.fill_between(
                    found["time"],
                    found[name] - spread,
                    found[name] + spread,
                    color=colour,
                    alpha=0.2,
                    lw=0,
                )

        for axes in (left, right):
            line(axes, "total", "all", "0.5", ls="--")
            axes.set(xlabel="time [√(H/g)]", xlim=(0, None), ylim=(0, None))
        line(left, "normal", "normal damping", "#1f5fa8")
        line(left, "tangential", "friction and tangential damping", "#c8561b")
        for name, shade in zip(thresholds, ("#2e7d46", "#1f5fa8", "#c8561b", "#7a4a9e")):
            line(right, name, f"shorter than {name.removeprefix('short_')} contact times", shade)
        left.set(title="by direction", ylabel="dissipated / energy released")
        right.set(title="by lifetime of the contact")
        for axes in (left, right):
            axes.legend(loc="upper left", fontsize="small")
        left.set_ylim(0, 1.45)
    return figure


def main() -> int:
    parser = command_line.Parser(prog="dem_reference.splits", description=__doc__.split("\n")[0])
    parser.add_argument("runs", nargs="+", type=Path, metavar="DEM.h5")
    parser.add_argument("-o", "--output", type=Path, help="table (CSV)")
    parser.add_argument("--chart", type=Path, help="chart (PNG, SVG)")
    options = parser.parse_args()
    if options.output:
        check_table(options.output)
    if options.chart:
        check_figure(options.chart)
    found = table(options.runs)
    if options.output:
        save(
            found,
            options.output,
            typed("python3 -m dem_reference.splits", sys.argv[1:]),
            f"mean and standard deviation over {len(options.runs)} packings, over the energy "
            "released; time in sqrt(H/g)",
        )
    if options.chart:
        write_figure(options.chart, draw(found), dpi=160)
    print(found.iloc[[-1]].T.to_string(header=False, float_format=lambda value: f"{value:.4g}"))
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(main))
