"""What a run takes is told before it, and what the machine cannot give is refused."""

import json
import os
import resource
import subprocess
import sys

import h5py
import pytest

from cases import cost, memory
from cases.case import load
from cases.programs import ROOT, program
from compare import __main__ as cli
from compare import cost as paired
from compare.commands import run as run_command

CASE = str(ROOT / "cases" / "column_ci")
HUGE = ["--set", "geometry.dimension=three_dimensional", "--set", "mpm.cell_size=1.5e-5"]
FINE = ["--set", "grains.diameter=1e-5"]


def measured(command: list, **more) -> tuple[subprocess.CompletedProcess, float]:
    """What a program says, and the most memory that it or one of its children took [bytes]."""
    watch = (
        "import resource, subprocess, sys\n"
        "code = subprocess.run(sys.argv[1:]).returncode\n"
        "print('peak', resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)\n"
        "sys.exit(code)"
    )
    done = subprocess.run(
        [sys.executable, "-c", watch, *map(str, command)],
        capture_output=True,
        text=True,
        timeout=300,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        check=False,
        **more,
    )
    return done, 1024.0 * float(done.stdout.split()[-1])


def within(estimate: float, taken: float, factor: float) -> bool:
    return taken / factor < estimate < taken * factor


def test_the_continuums_estimate_is_what_the_smallest_column_takes(tmp_path):
    told = cost.continuum(load(CASE))
    done, peak = measured([program("mpm_run"), CASE, "-o", tmp_path / "mpm.h5", "--quiet"])
    assert done.returncode == 0, done.stderr
    with h5py.File(tmp_path / "mpm.h5") as file:
        points = len(file["data/0/particles/cloud/id"])
        steps, seconds = file.attrs["steps"], file.attrs["cpu_seconds"]
    assert told.counts["points"] == points
    assert within(told.steps, steps, 1.5)  # the skeleton softens as the column spreads
    assert within(told.bytes, peak, 2)
    assert within(told.seconds, seconds, 3)
    assert within(told.disk, (tmp_path / "mpm.h5").stat().st_size, 2)


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["mpm.shape=linear", "mpm.points_per_cell=3"],
        ["geometry.dimension=three_dimensional"],
        ["geometry.dimension=axisymmetric", "walls.front_back=smooth", "mpm.precision=double"],
    ],
)
def test_of_a_law_of_one_stiffness_steps_are_told_to_one_in_a_hundred(tmp_path, words):
    sets = ["material.law=linear_elastic", "time.maximum=0.5", "time.frame_interval=0.1", *words]
    told = cost.continuum(load(CASE, sets))
    command = [program("mpm_run"), CASE, "-o", tmp_path / "mpm.h5", "--quiet"]
    command += [word for one in sets for word in ("--set", one)]
    subprocess.run([str(word) for word in command], check=True)
    with h5py.File(tmp_path / "mpm.h5") as file:
        assert told.counts["points"] == len(file["data/0/particles/cloud/id"])
        assert told.steps == pytest.approx(file.attrs["steps"], rel=0.01)


def test_the_grains_estimate_is_what_the_smallest_column_takes(tmp_path):
    told = paired.estimate(load(CASE)).dem
    words = [sys.executable, "-m", "dem_reference.run", CASE, "-o", tmp_path / "dem.h5", "--quiet"]
    done, peak = measured([*words, "--packings", tmp_path / "packings"])
    assert done.returncode == 0, done.stderr
    with h5py.File(tmp_path / "dem.h5") as file:
        grains, seconds = len(file["data/0/particles/cloud/id"]), file.attrs["cpu_seconds"]
        steps, dt = file.attrs["steps"], file[f"data/{file.attrs['steps']}"].attrs["dt"]
        contacts = len(file[f"data/{steps}/contacts/first"])
    assert told.counts["grains"] == pytest.approx(grains, rel=0.03)
    assert within(told.counts["contacts"], contacts, 1.5)
    assert told.time_step == dt and told.steps > steps
    assert within(told.bytes, peak, 3) and within(told.seconds, seconds, 3)
    assert within(told.disk, (tmp_path / "dem.h5").stat().st_size, 2)


def test_every_law_has_its_rate():
    laws = {file.stem for file in (ROOT / "mpm" / "materials").glob("*.cpp")} - {"dormand_prince"}
    laws |= {"external"}  # whatever a library takes
    for name in ("point_step", "shortening"):
        assert set(cost.rates()["continuum"][name]) == laws


def test_the_estimate_is_made_without_the_points():
    done, peak = measured([program("mpm_run"), CASE, *HUGE, "--estimate"])
    assert done.returncode == 0 and peak < 1e8
    told = json.loads(done.stdout.splitlines()[0])
    assert told["points"] > 1e9 and told["bytes"] > 4e11


@pytest.mark.parametrize(
    "words, key",
    [
        ([str(program("mpm_run")), CASE, *HUGE], "mpm.cell_size"),
        ([sys.executable, "-m", "dem_reference.run", CASE, *FINE], "grains.diameter"),
    ],
)
def test_an_engine_refuses_what_the_machine_cannot_give(tmp_path, words, key):
    done, peak = measured([*words, "-o", tmp_path / "result.h5"])
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert key in done.stderr and "GB of memory" in done.stderr and "choose larger" in done.stderr
    assert peak < 3e8 and not list(tmp_path.iterdir())


def no_engine(*_, **__):
    raise AssertionError("an engine was started")


@pytest.mark.parametrize("words, key", [(HUGE, "mpm.cell_size"), (FINE, "grains.diameter")])
def test_a_run_refuses_what_the_machine_cannot_give(tmp_path, monkeypatch, capsys, words, key):
    monkeypatch.setattr(run_command, "run_chains", no_engine)
    assert cli.main(["run", CASE, *words, "--out", str(tmp_path / "out")]) == 2
    line = capsys.readouterr().err
    assert key in line and "GB of memory" in line and line.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_hours_are_said_before_they_go_by(tmp_path, monkeypatch, capsys):
    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(run_command, "run_chains", stop)
    words = ["run", CASE, "--out", str(tmp_path / "out")]
    assert cli.main(words) == 130
    assert capsys.readouterr().err == "grainpair: interrupted\n"
    assert cli.main([*words, "--set", "mpm.cell_size=5e-5"]) == 130
    line, _ = capsys.readouterr().err.splitlines()
    assert " takes about " in line and " h of processor time" in line


def test_a_dry_run_shows_the_estimate_and_makes_nothing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(run_command, "run_chains", no_engine)
    assert cli.main(["run", CASE, "--dry-run", "--seeds", "3"]) == 0
    head, continuum, siblings, grains, total = capsys.readouterr().out.splitlines()
    assert head.split() == ["what", "memory", "steps", "processor", "disk"]
    assert (
        "1,600 points" in continuum
        and "siblings" in siblings
        and "grains × 3" in grains
        and "comparison" in total
    )
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["mpm_run"])
def test_memory_that_runs_out_all_the_same_is_one_line(tmp_path, name):
    def little():
        resource.setrlimit(resource.RLIMIT_AS, (400_000_000, 400_000_000))

    words = ["--set", "mpm.cell_size=1e-4", "-o", str(tmp_path / "mpm.h5")]
    # one frame, or the result would not find room either
    words += ["--set", "geometry.height=0.2", "--set", "time.frame_interval=100"]
    done = subprocess.run(
        [str(program(name)), CASE, *words],
        capture_output=True,
        text=True,
        preexec_fn=little,
        check=False,
    )
    assert done.returncode == 3 and done.stderr.count("\n") == 1
    assert "out of memory choose larger cells" in done.stderr
    assert not list(tmp_path.iterdir())


def group(root, version: int, inner: str, outer: str):
    """A machine of 8 GB with a control group in another one."""
    (root / "proc" / "self").mkdir(parents=True)
    (root / "proc" / "meminfo").write_text("MemTotal: 9 kB\nMemAvailable: 8000000 kB\n")
    line = "0::/a/b" if version == 2 else "4:memory:/a/b\n3:cpuset:/"
    (root / "proc" / "self" / "cgroup").write_text(line + "\n")
    top = root / "sys" / "fs" / "cgroup" / ("" if version == 2 else "memory")
    names = ("max", "current") if version == 2 else ("limit_in_bytes", "usage_in_bytes")
    for folder, most in ((top / "a" / "b", inner), (top / "a", outer)):
        folder.mkdir(parents=True, exist_ok=True)
        for name, value in zip(names, (most, "1000")):
            (folder / f"memory.{name}").write_text(f"{value}\n")


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize(
    "inner, outer, left",
    [
        ("5000", "max", 4000),
        ("max", "5000", 4000),
        ("500", "5000", 0),
        ("9223372036854771712", "9223372036854771712", 8_192_000_000),
    ],
)
def test_what_is_available_is_the_least_of_machine_and_groups(
    tmp_path, version, inner, outer, left
):
    group(tmp_path, version, inner, outer)
    assert memory.available(tmp_path) == left


def test_both_languages_find_the_same_memory():
    """Of this machine, by the figure that mpm_run's refusal tells."""
    command = [str(program("mpm_run")), CASE, *HUGE, "-o", "nowhere.h5"]
    line = subprocess.run(command, capture_output=True, text=True, check=False).stderr
    there = float(line.split("(there are ")[1].split()[0])
    assert there == pytest.approx(memory.available() / 1e9, rel=0.2)
