"""Jobs on a real Slurm, of one node on this machine: what fails there is handed in again where that
helps, with more of what it lacked, and told where it does not.
"""

import json
import signal
import subprocess
from pathlib import Path

import h5py
import pytest

import slurm_here
from cases import cluster
from cases.programs import ROOT, module
from slurm_jobs import Call, at_work, begun, made_up, profile, records, wait_for

pytest.importorskip("snakemake")
CI = ROOT / "cases" / "column_ci"


@pytest.fixture(scope="module")
def slurm():
    with slurm_here.running() as here:
        yield here


@pytest.fixture(autouse=True)
def told(slurm, monkeypatch):
    slurm.is_told_to(monkeypatch)


def test_a_node_that_fails(tmp_path, slurm):
    """Its job is started again by Slurm; or by us, where Slurm has called it failed before."""
    jobs = made_up(tmp_path / "kept", ["stranded"])
    call = Call(jobs, tmp_path / "kept", profile(tmp_path))
    wait_for(lambda: begun(tmp_path / "kept", "stranded"))
    ((number, _),) = records(tmp_path / "kept", "stranded")
    slurm.lose_node()
    wait_for(lambda: slurm.states()[number] == "PENDING")
    wait_for(lambda: not at_work("stranded.txt"))  # else its end is taken for that of the next
    slurm.hurry(number)
    assert call.end() == []
    assert begun(tmp_path / "kept", "stranded") == 2
    *earlier, (_, last) = records(tmp_path / "kept", "stranded")
    assert last["state"] == "COMPLETED" and last["attempt"] == len(earlier) + 1 <= 2


def test_what_ends_jobs_is_mended_or_told(tmp_path, slurm):
    folder, names = tmp_path / "kept", ("fine", "slow", "greedy", "cancelled", "wrong")
    # a minute at first, and too little memory for one of them
    where = profile(tmp_path, time_factor=0.01, memory_factor=0.8)
    call = Call(made_up(folder, names), folder, where)
    wait_for(lambda: all(begun(folder, name) for name in names), 90.0)
    ((number, _),) = records(folder, "cancelled")
    slurm.ask("scancel", str(number))
    told = call.end()
    assert {file.stem for file in folder.glob("*.txt")} == {"fine", "slow", "greedy"}
    # out of time, out of memory: again, with twice as much
    for name, key in (("slow", "minutes"), ("greedy", "memory")):
        first, *more = [one for _, one in records(folder, name)]
        assert first["state"] != "COMPLETED" and more[-1]["state"] == "COMPLETED"
        assert [one["attempt"] for one in more] == list(range(2, len(more) + 2))
        assert more[0][key] == pytest.approx(2 * first[key], abs=1)  # rounded up
    assert records(folder, "slow")[0][1]["state"] == "TIMEOUT"
    # cancelled, or with words of its own: once
    assert [begun(folder, name) for name in ("cancelled", "wrong")] == [1, 1]
    ((_, record),) = records(folder, "cancelled")
    assert record["state"] == "CANCELLED"
    assert len(told) == 2 and not any("\n" in line for line in told)
    assert told[0].startswith(f"cancelled: cancelled at attempt 1, Slurm's job {number} of 1 min")
    assert told[1].startswith("SystemExit: engine: lost its grains (a made-up reason) (see ")


def test_a_killed_driver_finds_its_jobs_again(tmp_path, slurm, monkeypatch):
    """The same command waits for what is on the cluster, and hands nothing in twice."""
    monkeypatch.setenv("GRAINPAIR_RUNS", str(tmp_path / "runs"))
    words = [CI, "--seeds", 2, "--quiet", "--profile", profile(tmp_path), "--table", tmp_path / "t"]
    words += ["--set", "time.maximum=0.5", "--set", "geometry.thickness=0.004"]
    words += ["--set", "dem.packing_attempts=1", "--set", "dem.void_ratio_tolerance=0.2"]
    command = module("dem_reference.ensemble", *words)
    before = set(slurm.states())
    first = subprocess.Popen(command, stderr=subprocess.PIPE, start_new_session=True)
    wait_for(lambda: set(slurm.states()) - before)
    first.send_signal(signal.SIGKILL)
    first.wait()
    second = subprocess.run(command, capture_output=True, text=True, timeout=200)
    assert second.returncode == 0, second.stderr
    new = {number: state for number, state in slurm.states().items() if number not in before}
    assert list(new.values()) == ["COMPLETED"]  # the seeds go together
    there = {file.name: data(file) for file in (tmp_path / "runs").rglob("[12].h5")}
    monkeypatch.setenv("GRAINPAIR_RUNS", str(tmp_path / "here"))
    here = module("dem_reference.ensemble", *words[:4], *words[6:])
    subprocess.run(here, check=True, capture_output=True, timeout=200)
    assert there == {file.name: data(file) for file in (tmp_path / "here").rglob("[12].h5")}


def test_numbers_that_are_dealt_out_again(tmp_path, slurm):
    """A controller that has lost its state begins anew: a stranger's job is neither taken for ours
    nor withdrawn for it.
    """
    folder = tmp_path / "kept"
    number = slurm.ask(
        "sbatch", "--parsable", "--mem=10", "--output=/dev/null", "--wrap=sleep 60"
    ).strip()
    (folder / "logs" / "slurm").mkdir(parents=True)
    record = {"bundle": "fine", "names": ["fine"], "attempt": 1, "state": "PENDING"}
    (folder / "logs" / "slurm" / f"{number}.json").write_text(json.dumps(record))
    where = profile(tmp_path)
    assert cluster.run(made_up(folder, ["fine"]), folder, where) == []
    assert begun(folder, "fine") == 1
    subprocess.run([where / "cancel.py", f"{number}:fine"], cwd=folder, check=True)
    assert slurm.states()[int(number)] in ("PENDING", "RUNNING")
    slurm.ask("scancel", number)
    wait_for(lambda: slurm.states()[int(number)] == "CANCELLED")


def data(file: Path) -> bytes:
    """Every particle of the last frame, bit by bit."""
    with h5py.File(file) as run:
        last = run["data"][max(run["data"], key=int)]
        return last["particles/cloud/position/x"][()].tobytes()
