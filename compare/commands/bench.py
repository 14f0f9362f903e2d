"""Speed of the continuum's step, its stages, its laws, the mapping and the output, as a fraction of
what this machine can do.

Everything is timed in one run, in processor time: point-steps per second of one core, beside the
same figure of bare kernels (mpm/bench/bare_kernels.hpp), the bandwidth of a triad and the rate of
multiply-adds. Compare ratios, not seconds. Of two threads also how many times faster they are than
one, on the clock. With --quick each figure is the best of three.

A point-step is one point advanced by one step, all stages of it and all that has to be done between
steps (sorting, the choice of the step) included, output not; core-seconds are the processor time of
all threads. Other codes count the same way (points times steps over seconds times threads), of a
whole run: hold them against the column in flow, not against the start. At the start each cell holds
its full number of points, in order, and nothing moves; in flow cells hold three or five, points are
sorted every few dozen steps, and they cover more nodes. A step's cost is not the cost of a result:
that takes the length of the step and the cells that it needs, too.
"""
import json

from cases.errors import EngineError
from cases.programs import call, program

PACKAGES = ["studies"]
TARGETS = ["benchmarks"]

# the full model takes a minute to come into flow
QUICK = "(state:start|law:drucker_prager|bare_kernels|frame).*points:14400/|triad|multiply_add"


def arguments(parser):
    parser.add_argument(
        "--quick", action="store_true", help="14 400 points only: under two minutes"
    )
    parser.add_argument(
        "--json", action="store_true", help="print a list of records instead of a table"
    )


def run(options) -> int:
    rows = records(options.quick)
    print(json.dumps(rows, indent=1) if options.json else table(rows))
    return 0


def records(quick: bool) -> list[dict]:
    """One record per measurement: what was run, points, point-steps per core and second, fractions
    of the limits.
    """
    settings = ["--benchmark_min_time=0.2"] + (
        [f"--benchmark_filter={QUICK}", "--benchmark_repetitions=3"] if quick else []
    )
    measured = [record(entry) for entry in timed("step_benchmark", settings)]
    measured += [
        law_record(entry)
        for entry in timed(
            "law_benchmark", ["--benchmark_min_time=0.1", "--benchmark_filter=mixed"]
        )
    ]
    measured += [
        mapping_record(entry)
        for entry in timed("tests/coarse_grain_benchmark", ["--benchmark_min_time=0.2"])
    ]
    bare = {
        (row["dimension"], row["points"]): row["point_steps_per_core_second"]
        for row in measured
        if row["benchmark"] == "bare_kernels"
    }
    for row in measured:
        limit = min(
            (key for key in bare if key[0] == row.get("dimension")),
            default=None,
            key=lambda key: abs(key[1] / row["points"] - 1.0),
        )
        if limit and row["benchmark"] == "step":
            row["fraction_of_bare_kernel"] = row["point_steps_per_core_second"] / bare[limit]
    add_speed_up(measured)
    return measured


def add_speed_up(rows: list[dict]) -> None:
    """To every step of several threads, how many times faster than with one of them it is on the
    clock.
    """
    what = ("state", "dimension", "shape", "precision", "law", "points")
    steps = [row for row in rows if row["benchmark"] == "step"]
    alone = {
        tuple(row[key] for key in what): row["point_steps_per_second"]
        for row in steps
        if row["threads"] == 1
    }
    for row in steps:
        if row["threads"] > 1:
            row["speed_up"] = row["point_steps_per_second"] / alone[tuple(row[key] for key in what)]


def timed(name: str, settings: list[str]) -> list[dict]:
    """Entries of a Google Benchmark program, the best of its repetitions."""
    command = [str(program(name)), "--benchmark_format=json", *settings]
    done = call(command)
    if done.returncode:
        raise EngineError(
            f"{name}: "
            f"{done.stderr.strip().splitlines()[-1] if done.stderr.strip() else 'ended early'}"
        )
    best: dict[str, dict] = {}
    for entry in json.loads(done.stdout)["benchmarks"]:
        if entry["run_type"] == "iteration":
            kept = best.setdefault(entry["name"], entry)
            kept |= {clock: min(kept[clock], entry[clock]) for clock in ("cpu_time", "real_time")}
    return list(best.values())


def record(entry: dict) -> dict:
    """A step, a stage or a limit; its name holds key:value pairs."""
    pairs = dict(part.split(":", 1) for part in entry["name"].split("/") if ":" in part)
    row = {
        key: int(value) if key in ("dimension", "threads") else value
        for key, value in pairs.items()
        if key not in ("points", "iterations")
    }
    if row["benchmark"] == "triad":
        return row | {"bytes_per_second": entry["bytes_per_second"]}
    if row["benchmark"] == "multiply_add":
        return row | {"flops_per_second": entry["flops"]}
    unit = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0}[entry["time_unit"]]
    # of a part of the step the program itself takes the processor time, and hands it over
    clock = "real_time" if entry["name"].endswith("/manual_time") else "cpu_time"
    row |= {
        "points": int(entry["points"]),
        "point_steps_per_core_second": entry["points"] / (entry[clock] * unit),
        "point_steps_per_second": entry["points"] / (entry["real_time"] * unit),
    }
    return row | {
        key: entry[key]
        for key in ("bytes_per_point", "seconds_since_release", "kinetic_over_potential")
        if key in entry
    }


def law_record(entry: dict) -> dict:
    """A law's update alone, points in every regime."""
    law, integrator, _ = entry["name"].split("/")[:3]
    return {
        "benchmark": "law",
        "law": law,
        "integrator": integrator,
        "threads": 1,
        "point_steps_per_core_second": 1e9 / entry["ns/point"],
    }


def mapping_record(entry: dict) -> dict:
    """The averaging of one frame of grains: grains, contacts and pairs (of a point of a grain or a
    branch, and a node) per second of a core.
    """
    return {
        "benchmark": "mapping",
        "case": entry["name"],
        "threads": 1,
        **{key.replace("/s", "_per_second"): entry[key] for key in entry if key.endswith("/s")},
    }


def table(rows: list[dict]) -> str:
    lines = []
    for row in rows:
        what = " ".join(
            str(row[key])
            for key in (
                "benchmark",
                "state",
                "dimension",
                "shape",
                "precision",
                "law",
                "integrator",
                "case",
                "threads",
                "points",
            )
            if key in row
        )
        figures = (
            [f"{row['point_steps_per_core_second'] / 1e6:8.2f} M point-steps per core-second"]
            if "point_steps_per_core_second" in row
            else []
        )
        figures += (
            [f"{row['fraction_of_bare_kernel']:.2f} of bare kernels"]
            if "fraction_of_bare_kernel" in row
            else []
        )
        figures += [f"{row['speed_up']:.2f} times as fast as one"] if "speed_up" in row else []
        figures += (
            [f"{row['bytes_per_point']:.0f} bytes per point"] if "bytes_per_point" in row else []
        )
        figures += [
            f"{row[key]:.3g} {key.replace('_', ' ')}"
            for key in row
            if key.endswith("per_second") and not key.startswith("point")
        ]
        lines.append(f"{what:<78} {', '.join(figures)}")
    return "\n".join(lines)
