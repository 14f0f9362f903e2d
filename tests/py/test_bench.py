"""The bench command: what it prints is what the benchmark programs measured."""

import json
import re

from cases.programs import call, program
from compare.commands import bench


def test_records_of_a_small_run():
    entries = bench.timed(
        "step_benchmark",
        [
            "--benchmark_min_time=0.01",
            "--benchmark_filter=step/state:start/dimension:2/.*threads:1/points:1000/|multiply_add",
        ],
    )
    rows = [bench.record(entry) for entry in entries]
    assert {row["benchmark"] for row in rows} == {"multiply_add", "step"}
    step = next(row for row in rows if row["benchmark"] == "step")
    assert (step["dimension"], step["threads"], step["law"]) == (2, 1, "drucker_prager")
    assert abs(step["points"] / 1000 - 1.0) < 0.1  # a whole number of cells a side
    entry = next(entry for entry in entries if "benchmark:step" in entry["name"])
    assert (
        abs(step["point_steps_per_core_second"] * entry["cpu_time"] * 1e-9 / step["points"] - 1.0)
        < 1e-12
    )
    json.dumps(rows)


def test_the_column_is_timed_at_the_start_in_flow_and_at_rest():
    """Each state is what its name says. In flow, kinetic energy is 0.08 of the potential energy in
    a plane and 0.05 in space.
    """
    rows = {
        (row["state"], row["dimension"]): row
        for row in map(
            bench.record,
            bench.timed(
                "step_benchmark",
                [
                    "--benchmark_min_time=0.01",
                    "--benchmark_filter=step/.*drucker_prager/threads:1/points:1000/",
                ],
            ),
        )
    }
    fall = (0.1 / 9.81) ** 0.5
    for dimension in (2, 3):
        start, flow, rest = (rows[state, dimension] for state in ("start", "flow", "rest"))
        assert start["seconds_since_release"] < 0.01 * fall
        assert start["kinetic_over_potential"] < 1e-4
        assert 2.0 <= flow["seconds_since_release"] / fall < 2.5
        assert flow["kinetic_over_potential"] > 0.03
        assert rest["seconds_since_release"] > 3.0 * fall
        assert rest["kinetic_over_potential"] < 0.1 * flow["kinetic_over_potential"]
        assert start["points"] == flow["points"] == rest["points"]


def test_the_quick_run_computes_no_collapse_of_the_full_model():
    """And leaves out no row of 14 400 points but those."""
    everything = [
        name
        for name in call(
            [str(program("step_benchmark")), "--benchmark_list_tests=true"]
        ).stdout.splitlines()
        if "points:14400/" in name
    ]
    left_out = {name for name in everything if not re.search(bench.QUICK, name)}
    assert left_out and left_out == {
        name for name in everything if "law:solid_fluid" in name and "state:start" not in name
    }


def test_two_threads_are_held_against_one():
    step = {
        "benchmark": "step",
        "state": "flow",
        "dimension": 2,
        "shape": "linear",
        "precision": "double",
        "law": "mu_i",
        "points": 100,
    }
    rows = [
        step | {"threads": 2, "point_steps_per_second": 9.0},
        step | {"threads": 1, "point_steps_per_second": 5.0},
        step | {"threads": 1, "state": "start", "point_steps_per_second": 6.0},
        step | {"threads": 1, "law": "linear_elastic", "point_steps_per_second": 1.0},
    ]
    bench.add_speed_up(rows)
    assert rows[0]["speed_up"] == 1.8 and all("speed_up" not in row for row in rows[1:])


def test_a_step_costs_more_than_the_bare_kernels():
    """The bare kernels are a limit: a step that beat them would mean that they, or the step, leave
    something out.
    """
    entries = bench.timed(
        "step_benchmark",
        [
            "--benchmark_min_time=0.05",
            "--benchmark_filter=(bare_kernels|step/state:start.*law:drucker_prager)"
            ".*threads:1/points:14400/",
        ],
    )
    rate = {
        (row["benchmark"], row["dimension"]): row["point_steps_per_core_second"]
        for row in map(bench.record, entries)
        if row["shape"] == "quadratic_bspline"
    }
    for dimension in (2, 3):
        assert rate["step", dimension] < rate["bare_kernels", dimension]


def test_laws_and_mapping_have_rates():
    laws = [
        bench.law_record(entry)
        for entry in bench.timed(
            "law_benchmark",
            ["--benchmark_min_time=0.01", "--benchmark_filter=linear_elastic/.*mixed"],
        )
    ]
    # between a microsecond and a nanosecond a point, on any machine that builds this
    assert all(1e6 < row["point_steps_per_core_second"] < 1e9 for row in laws) and laws
    frames = [
        bench.mapping_record(entry)
        for entry in bench.timed(
            "tests/coarse_grain_benchmark",
            ["--benchmark_min_time=0.01", "--benchmark_filter=/7000$"],
        )
    ]
    assert frames and all(
        row["pairs_per_second"] > row["contacts_per_second"] > 0.0 for row in frames
    )
