"""The points of an element test: which there are, which are missing, running one, gathering their records."""
import itertools
import json
import os
import tempfile
import time
from importlib import import_module
from pathlib import Path

from cases.errors import EngineError
from dem_reference.element import records
from dem_reference.element.case import ROOT, Case
from dem_reference.output import commit


def test_module(case: Case):
    """The module of the case's test, with `points(case)`, `KEYS` (what names a point) and `run(grains, point, folder)`."""
    return import_module(f"dem_reference.element.{case.test}")


def points(case: Case) -> list[dict]:
    """All points of the case, those to run first at the front, once per seed."""
    common = {
        "grains": case["element.grains"],
        "time_step_fraction": case["element.time_step_fraction"],
    }
    return [point | {"seed": seed} | common for point, seed in test_module(case).points(case)]


def quick_point(case: Case) -> dict:
    """The first point, with fewer grains."""
    return points(case)[0] | {"grains": case["element.quick_grains"]}


def name_of(case: Case, point: dict) -> str:
    """A file name for the point, e.g. `0.5_20_1`."""
    return "_".join(f"{point[key]:g}" for key in (*test_module(case).KEYS, "seed"))


def reference_file(case: Case) -> Path:
    return case.folder / "reference" / f"{case.test}.csv"


def record_file(case: Case, point: dict) -> Path:
    """Where a point's record waits to be gathered."""
    return ROOT / "build" / "element" / case.test / f"{name_of(case, point)}.json"


def missing(case: Case) -> list[dict]:
    """The points that are not in the reference yet, whether measured or failed."""
    known = {name_of(case, row) for row in records.read(reference_file(case))}
    return [point for point in points(case) if name_of(case, point) not in known]


def run_point(case: Case, point: dict) -> list[dict]:
    """Runs one point and returns its rows; a failure is a row too, whose status says why."""
    wall, cpu = time.time(), os.times()
    with tempfile.TemporaryDirectory(prefix="grainpair_") as folder:
        try:
            results, status = test_module(case).run(case.grains, point, Path(folder)), "measured"
        except (EngineError, RuntimeError) as error:
            results, status = {}, f"failed: {error}".replace("\n", " ")
    used = os.times()
    cost = {
        "status": status,
        "commit": commit(),
        "machine": records.machine(),
        "wall_seconds": time.time() - wall,
        "cpu_seconds": sum(used[:4]) - sum(cpu[:4]),
    }
    rows = results if isinstance(results, list) else [results]
    identity = {key: value for key, value in point.items() if not isinstance(value, list)}
    return [identity | row | cost for row in rows]


def store_point(case: Case, point: dict) -> Path:
    """Runs a point and writes its record (atomically)."""
    path = record_file(case, point)
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = run_point(case, point)
    part = path.with_suffix(".part")
    part.write_text(json.dumps(rows))
    os.replace(part, path)
    return path


def gather(case: Case, command: str) -> int:
    """Puts every waiting record into the reference; returns how many points were added."""
    rows = {}
    for row in records.read(reference_file(case)):
        rows.setdefault(name_of(case, row), []).append(row)
    waiting = [
        path for path in (record_file(case, point) for point in missing(case)) if path.exists()
    ]
    for path in waiting:
        rows[path.stem] = json.loads(path.read_text())
    order = {name_of(case, point): i for i, point in enumerate(points(case))}
    if waiting:
        ordered = sorted(rows, key=lambda name: order.get(name, len(order)))
        records.write(
            reference_file(case), list(itertools.chain(*(rows[name] for name in ordered))), command
        )
    return len(waiting)
