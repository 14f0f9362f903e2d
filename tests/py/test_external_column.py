"""A column with a law of a library, and with the same law as it is built in."""

import statistics

import h5py
import pytest

from cases.programs import ROOT, program
from cases.stages import Stage, run_stages
from compare.study.figures import at_end, figures

CASE = ROOT / "cases" / "column_ci"
COMMON = (
    "mpm.cell_size=0.002",
    "time.maximum=4",
    "time.frame_interval=1",
    "mpm.stiffness=as given",
)
BUILT_IN = (
    "material.law=drucker_prager",
    "material.young_modulus=1e6",
    "mpm.stiffness=as given",
)
K, G = 1e6 / (3 * 0.4), 1e6 / 2.6
FIGURES = ("run_out_95", "centre", "height", "peak")


def library(stress_ratio: float) -> tuple[str, ...]:
    return (
        "material.law=external",
        "material.library=drucker_prager",
        "material.interface=grainpair",
        f"material.constants=[{K!r}, {G!r}, {stress_ratio}]",
        "material.stress_measure=kirchhoff",
    )


def run(folder, sets, jitter=0.0, seed=1) -> dict:
    words = [word for one in (*COMMON, *sets, f"mpm.jitter={jitter}") for word in ("--set", one)]
    result = folder / "mpm.h5"
    told = [program("mpm_run"), CASE, *words, "--seed", seed, "-o", result]
    run_stages([Stage("column", told)], quiet=True)
    found = figures(at_end(result))
    return {name: found[name] for name in FIGURES}


@pytest.fixture(scope="module")
def displaced(tmp_path_factory) -> list[dict]:
    """The built-in law from points displaced by a thousandth of their spacing: what chance does."""
    folder = tmp_path_factory.mktemp("displaced")
    return [run(folder, BUILT_IN, 1e-3, seed) for seed in range(1, 7)]


def apart(found: dict, runs: list[dict]) -> dict[str, float]:
    """Distance from the mean of runs, in their standard deviations."""
    out = {}
    for name in FIGURES:
        of_runs = [one[name] for one in runs]
        out[name] = abs(found[name] - statistics.mean(of_runs)) / statistics.stdev(of_runs)
    return out


def test_a_column_of_a_library_is_one_of_the_displaced_runs(tmp_path, displaced):
    """Student's t of one run against six others, 5 degrees of freedom: beyond 4.8 in one of four
    figures by chance less often than once in fifty.
    """
    found = apart(run(tmp_path, library(0.9)), displaced)
    assert max(found.values()) < 4.8 * (1 + 1 / 6) ** 0.5, found


def test_control_another_friction_is_told_apart(tmp_path, displaced):
    found = apart(run(tmp_path, library(0.8)), displaced)
    assert max(found.values()) > 4.8 * (1 + 1 / 6) ** 0.5, found


def test_steps_are_those_of_the_built_in_law(tmp_path):
    steps = {}
    for name, sets in (("built in", BUILT_IN), ("library", library(0.9))):
        run(tmp_path, sets)
        with h5py.File(tmp_path / "mpm.h5") as file:
            steps[name] = file.attrs["steps"]
    assert steps["library"] == steps["built in"]
