"""The points of an element test: which there are, which are missing, running and gathering them."""

import itertools
import json
import os
import time
from pathlib import Path

from cases.errors import EngineError
from cases.files import write_atomically
from cases.jobs import Job
from cases.programs import own, short
from cases.provenance import commit
from cases.scratch import temporary
from compare.element import records
from compare.element.case import Case
from compare.element.records import Rows
from compare.element.tests import test_of


def points(case: Case) -> list[dict]:
    """All points of the case, those to run first at the front, once per seed."""
    common = {
        "grains": case["element.grains"],
        "time_step_fraction": case["element.time_step_fraction"],
    }
    return [point | {"seed": seed} | common for point, seed in test_of(case).points(case)]


def quick_point(case: Case) -> dict:
    """The first point, with fewer grains."""
    return points(case)[0] | {"grains": case["element.quick_grains"]}


def name_of(case: Case, point: dict) -> str:
    """A file name for the point, e.g. `0.5_20_1`."""
    return "_".join(f"{point[key]:g}" for key in (*test_of(case).keys, "seed"))


def record_file(case: Case, point: dict) -> Path:
    """Where a point's record waits to be gathered."""
    return place(case) / f"{name_of(case, point)}.json"


def place(case: Case) -> Path:
    """The folder in which records of a case wait; other grains of the same test wait apart."""
    name = case.folder.name
    return own("build", "element", case.test if name == case.test else f"{case.test}-{name}")


def missing(case: Case) -> list[dict]:
    """The points that are not in the reference yet, whether measured or failed."""
    known = {name_of(case, row) for row in records.read(records.reference_file(case))}
    return [point for point in points(case) if name_of(case, point) not in known]


def jobs(case: Case, some: list[dict]) -> dict[str, Job]:
    """What measures the points, by their names."""
    named = {name_of(case, point): record_file(case, point) for point in some}
    folder = str(short(case.folder))
    return {
        name: Job(file, ("compare.element", folder, f"--point={name}"))
        for name, file in named.items()
    }


def run_point(case: Case, point: dict) -> Rows:
    """Runs one point and returns its rows; a failure is a row too, whose status says why."""
    wall, cpu = time.time(), os.times()
    with temporary() as folder:
        try:
            rows, status = test_of(case).run(case.grains, point, folder), "measured"
        except EngineError as error:
            rows, status = [{}], f"failed: {error}".replace("\n", " ")
    used = os.times()
    cost = {
        "status": status,
        "commit": commit(),
        "machine": records.machine(),
        "wall_seconds": time.time() - wall,
        "cpu_seconds": sum(used[:4]) - sum(cpu[:4]),
    }
    identity = {key: value for key, value in point.items() if not isinstance(value, list)}
    return [identity | row | cost for row in rows]


def store_point(case: Case, point: dict) -> Path:
    """Runs a point and writes its record (atomically)."""
    path = record_file(case, point)
    write_atomically(path, json.dumps(run_point(case, point)))
    return path


def gather(case: Case, command: str) -> int:
    """Puts every waiting record into the reference; returns how many points were added."""
    rows: dict[str, Rows] = {}
    for row in records.read(records.reference_file(case)):
        rows.setdefault(name_of(case, row), []).append(row)
    waiting = [
        path for path in (record_file(case, point) for point in missing(case)) if path.exists()
    ]
    for path in waiting:
        rows[path.stem] = json.loads(path.read_text())
    order = {name_of(case, point): i for i, point in enumerate(points(case))}
    if waiting:
        ordered = sorted(rows, key=lambda name: order.get(name, len(order)))
        everything = list(itertools.chain(*(rows[name] for name in ordered)))
        records.write(records.reference_file(case), everything, command)
    return len(waiting)
