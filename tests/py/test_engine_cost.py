"""Costs are compared by the engine's own processor time, and unknown where no file tells it."""

import json
import math

import pytest

from cases.programs import ROOT, call, program
from compare.mapping.runs import open_run
from compare.metrics import all_metrics
from compare.study import distance, frontier, signature
from synthetic import write_run


def test_a_cost_is_the_engines_own_and_unknown_where_no_file_told_it():
    """Audit and output, in `cpu_seconds`, never stand in for it."""
    told = {"cpu_seconds": 30.0, "cpu_seconds_engine": 24.0, "tau": [0.0, 6.0]}
    old = {name: value for name, value in told.items() if name != "cpu_seconds_engine"}
    assert distance.cost(told) == 4.0 and math.isnan(distance.cost(old))
    assert (
        frontier.times_cheaper(0.5, {"members": [told, told]}) == "8 times cheaper than the grains"
    )
    for members in ([old], [told, old]):
        assert "not known" in frontier.times_cheaper(0.5, {"members": members})


@pytest.mark.parametrize("engine, own", [("mpm", 1.2), ("dem", 24.0)])
def test_signatures_and_metrics_take_the_engines_own_and_leave_it_out_where_it_is_not(
    tmp_path, engine, own
):
    write_run(tmp_path / f"{engine}.h5", engine, frames=2)
    run = open_run(tmp_path / f"{engine}.h5")
    run.attributes |= {"steps": 1}
    told = all_metrics()["cpu_seconds_engine"]
    assert signature.compact(run)["cpu_seconds_engine"] == told(run) == own
    del run.attributes["cpu_seconds_engine"]
    assert "cpu_seconds_engine" not in signature.compact(run) and math.isnan(told(run))


def test_a_committed_reference_tells_a_cost_only_if_its_runs_did():
    for path in ROOT.glob("cases/*/reference/grains.json"):
        kept = json.loads(path.read_text())
        told = all("cpu_seconds_engine" in one for one in kept["members"])
        assert math.isfinite(frontier.grain_cost(kept)) == told
        assert ("not known" in frontier.times_cheaper(0.1, kept)) == (not told)


def test_parts_of_the_continuums_processor_time_add_up(tmp_path):
    """What lies between the parts is the loop, and the end of a run of a few tenths of a second."""
    words = ["--set", "time.maximum=2", "--quiet", "-o", tmp_path / "mpm.h5"]
    assert call([program("mpm_run"), ROOT / "cases" / "column_ci", *words]).returncode == 0
    told = open_run(tmp_path / "mpm.h5").attributes
    parts = [told[f"cpu_seconds_{part}"] for part in ("engine", "output", "setup")]
    whole = told["cpu_seconds"] * (1.0 + 1e-12)  # sums of doubles
    assert min(parts) > 0.0 and 0.9 * whole < sum(parts) <= whole
