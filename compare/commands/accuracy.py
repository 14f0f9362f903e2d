"""Speed against accuracy of the law's two stress integrators over step size.

On one path through all four regimes: every run drives one material point along it by mpm_point. The
error is that of the quasi-static stress, over the path, and of the plastic dissipation at its end,
against Dormand-Prince with the smallest step; the cost is the time spent in the law's updates.
"""

import json
from pathlib import Path

import h5py
import matplotlib
import numpy as np

from cases.errors import EngineError
from cases.files import check_figure, write_figure
from cases.programs import ROOT, call, program
from cases.scratch import temporary

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

# duration [s] and D = [xx, yy, zz, xy, yz, zx] [1/s], compression positive, of each leg: sheared
# while loose, compressed onto the critical-state locus and along it, opened, compressed again.
LEGS = [
    (0.03, [2.0, -2.0, 0.0, 5.0, 0.0, 0.0]),
    (0.03, [2.0 + 0.04 / 3, -2.0 + 0.04 / 3, 0.04 / 3, 5.0, 0.0, 0.0]),
    (0.02, [2.0 - 0.1 / 3, -2.0 - 0.1 / 3, -0.1 / 3, 5.0, 0.0, 0.0]),
    (0.02, [2.0 + 0.11 / 3, -2.0 + 0.11 / 3, 0.11 / 3, 5.0, 0.0, 0.0]),
]
STEPS = (5, 10, 20, 50, 100, 200, 500, 1000, 2000)  # per leg
REFERENCE = 5000  # steps per leg


def arguments(parser):
    parser.add_argument(
        "--case",
        type=Path,
        default=ROOT / "cases" / "column",
        help="case the material comes from (column)",
    )
    parser.add_argument("--out", type=Path, default=Path("accuracy.svg"), help="figure to write")


def run(options) -> int:
    check_figure(options.out)
    reference, _ = drive(options.case, "dormand_prince", REFERENCE)
    rows = []
    for integrator in ("implicit", "dormand_prince"):
        for steps in STEPS:
            end, cost = drive(options.case, integrator, steps)
            rows.append((integrator, steps, *errors(end, reference), cost, int(end["switches"])))
    print(
        "integrator       steps/leg  strain/step  stress error  dissipation error  "
        "ns/update  switches"
    )
    for integrator, steps, stress, dissipation, cost, switches in rows:
        print(
            f"{integrator:<16} {steps:>9}  {0.3 / steps:>11.1e}  {stress:>12.1e}  "
            f"{dissipation:>17.1e}  {cost:>9.0f}  {switches:>8}"
        )
    draw(rows, options.out)
    print(options.out)
    return 0


def drive(case: Path, integrator: str, steps: int) -> tuple[dict, float]:
    """Stress at 25 instants of each leg's grid or fewer, dissipation, and the cost of one update.

    The cost [ns] is the least of three runs.
    """
    text = [
        f"case = {json.dumps(str(case.resolve()))}",
        f'set = ["material.law=critical_state", "material.integrator={integrator}"]',
        f"every = {max(steps // 5, 1)}",
        "[start]",
        "void_ratio = 0.71",
        "stress = [750.0, 1500.0, 750.0, 0.0, 0.0, 0.0]",
    ]
    for duration, rate in LEGS:
        text += [
            "[[leg]]",
            'path = "strain"',
            f"duration = {duration}",
            f"rate = {rate}",
            f"steps = {steps}",
        ]
    with temporary() as folder:
        path, out = folder / "path.toml", folder / "point.h5"
        path.write_text("\n".join(text) + "\n")
        costs = []
        for _ in range(3):
            done = call([program("mpm_point"), path, "-o", out])
            if done.returncode:
                raise EngineError(f"mpm_point: {done.stderr.strip()}")
            with h5py.File(out) as file:
                costs.append(1e9 * file.attrs["update_seconds"] / file.attrs["updates"])
                stress = np.array([file[f"sigma_q_{name}"][:] for name in ("xx", "yy", "zz", "xy")])
                end = {
                    "stress": stress,
                    "dissipation": file["plastic_dissipation"][-1],
                    "switches": file.attrs["regime_switches"],
                }
    return end, min(costs)


def errors(end: dict, reference: dict) -> tuple[float, float]:
    """Root-mean-square stress error over the 20 common instants and dissipation error, relative."""
    difference = end["stress"] - reference["stress"]
    stress = np.sqrt((difference**2).sum() / (reference["stress"] ** 2).sum())
    return stress, abs(end["dissipation"] / reference["dissipation"] - 1)


def draw(rows: list, out: Path):
    figure, axes = plt.subplots(1, 2, figsize=(9, 4), sharey=True)
    for integrator, marker in (("implicit", "o"), ("dormand_prince", "s")):
        own = [row for row in rows if row[0] == integrator]
        for axis, column in zip(axes, (2, 3)):
            axis.loglog(
                [row[column] for row in own],
                [row[1] * len(LEGS) * row[4] * 1e-3 for row in own],
                marker=marker,
                label=integrator.replace("_", "–").replace("dormand–prince", "Dormand–Prince"),
            )
    axes[0].set(xlabel="error of the quasi-static stress", ylabel="time for the path [µs]")
    axes[1].set(xlabel="error of the plastic dissipation")
    axes[0].legend(frameon=False)
    figure.tight_layout()
    write_figure(out, figure)
    plt.close(figure)
