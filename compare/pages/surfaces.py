"""The picture of the README: free surfaces of a run, from the table beside it.

    python3 -m compare.pages.surfaces          # docs/pictures/collapse.png from collapse.csv
    python3 -m compare.pages.surfaces RUNDIR   # the table anew, from a run, and the picture

Columns: time [sqrt(H/g)], x [L0], the height of the continuum and of the grains there [L0].
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from cases import command_line, provenance
from cases.errors import exit_code
from cases.files import write_figure, write_table
from cases.programs import ROOT
from cases.style import COLOUR, STYLE
from compare.mapping.reductions import common_frames, surface
from compare.verdict.comparison import load

PICTURE = ROOT / "docs" / "pictures" / "collapse.png"
TABLE = PICTURE.with_suffix(".csv")
TIMES = (0.0, 0.8, 1.6, 6.0)  # sqrt(H/g); of the last the frame nearest to it


def table_of(folder: Path) -> pd.DataFrame:
    """The free surfaces of both sides at TIMES, of the folder of a run."""
    mpm, dem = load(folder).first
    frames, tau = common_frames(mpm, dem), mpm.tau()
    rows = []
    for time in TIMES:
        i, k = min(frames, key=lambda pair: abs(tau[pair[0]] - time))
        columns = [run.fields.grid.x / run.length for run in (mpm, dem)]
        heights = [surface(run, frame) / run.length for run, frame in ((mpm, i), (dem, k))]
        rows.append(
            pd.DataFrame(
                {
                    "time": tau[i],
                    "x": columns[0],
                    "continuum": heights[0],
                    "grains": np.interp(columns[0], columns[1], heights[1]),
                }
            )
        )
    return pd.concat(rows)


def draw(table: pd.DataFrame):
    """One panel for each instant: the grains' surface filled, the continuum's as a line."""
    with plt.rc_context(STYLE):
        times = list(dict.fromkeys(table["time"]))
        figure, axes = plt.subplots(
            1, len(times), figsize=(10.0, 2.7), sharex=True, sharey=True, layout="constrained"
        )
        far = table["x"][(table["grains"] > 0.0) | (table["continuum"] > 0.0)].max()
        for ax, time in zip(axes, times):
            now = table[table["time"] == time]
            ax.fill_between(
                now["x"], now["grains"], color=COLOUR["dem"], alpha=0.35, lw=0.0, label="grains"
            )
            ax.plot(now["x"], now["continuum"], color=COLOUR["mpm"], label="continuum")
            ax.set(title=f"t = {time:.1f} √(H/g)", xlabel="x/L₀", xlim=(0.0, far + 0.1))
        axes[0].set(ylabel="height/L₀", ylim=(0.0, None))
        axes[-1].legend(loc="upper right")
    return figure


def main() -> int:
    parser = command_line.Parser(
        prog="compare.pages.surfaces", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("run", nargs="?", type=Path, metavar="RUNDIR", help="folder of a run")
    options = parser.parse_args()
    if options.run:
        made = f"python3 -m compare.pages.surfaces runs/{options.run.name}"
        notes = "time [sqrt(H/g)], x [L0], height of the continuum and of the grains [L0]"
        head = provenance.head(provenance.about(made), notes)
        write_table(TABLE, head, table_of(options.run))
    write_figure(PICTURE, draw(pd.read_csv(TABLE, comment="#")), dpi=100)
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(main))
