"""Jobs on a real Slurm, of one node on this machine: what fails there is handed in again where that
helps, with more of what it lacked, and told where it does not.
"""

import json
import shutil
import signal
import subprocess
import threading
import time
from pathlib import Path

import h5py
import pytest

import slurm_here
from cases import cluster
from cases.cluster import PROFILE
from cases.jobs import Job
from cases.programs import ROOT, module

pytest.importorskip("snakemake")
CI = ROOT / "cases" / "column_ci"
# What made-up jobs do; each notes first that it has begun.
JOBS = {
    "fine": "",
    # beyond its minute at first
    "slow": "time.sleep(300 if begun == 1 else 0)",
    # more than it is given at first: nothing holds it but Slurm
    "greedy": "kept = bytearray(600_000_000); time.sleep(12)",
    # until somebody cancels it
    "cancelled": "time.sleep(300)",
    "wrong": "sys.exit('engine: lost its grains (a made-up reason)')",
    # its node fails while it runs the first time
    "stranded": "time.sleep(300 if begun == 1 else 0)",
}
CODE = """
import sys, time
from pathlib import Path
file = Path({file!r})
with open(file.with_suffix('.begun'), 'a') as notes:
    notes.write('x')
begun = len(file.with_suffix('.begun').read_text())
{what}
file.write_text('made')
"""


@pytest.fixture(scope="module")
def slurm():
    with slurm_here.running() as here:
        yield here


@pytest.fixture(autouse=True)
def told(slurm, monkeypatch):
    monkeypatch.setenv("SLURM_CONF", slurm.environment["SLURM_CONF"])


def profile(folder: Path, **keys) -> Path:
    """Ours, which looks more often, and with other keys in cluster.toml."""
    made = folder / "profile"
    shutil.copytree(PROFILE, made)
    config = (made / "config.yaml").read_text()
    (made / "config.yaml").write_text(config.replace("latency-wait: 60", "latency-wait: 5"))
    text = (made / "cluster.toml").read_text()
    for key, value in keys.items():
        assert f"\n{key} = " in text
        lines = [
            f"{key} = {value!r}" if line.startswith(f"{key} = ") else line
            for line in text.splitlines()
        ]
        text = "\n".join(lines) + "\n"
    (made / "cluster.toml").write_text(text)
    return made


def made_up(folder: Path, names) -> dict[str, Job]:
    """Jobs that do as JOBS says: statements that a module of Python's own runs."""
    jobs = {}
    for name in names:
        file = folder / f"{name}.txt"
        code = CODE.format(file=str(file), what=JOBS[name])
        jobs[name] = Job(file, ("timeit", "-n1", "-r1", code), seconds=901.0, bytes=1.0)
    return jobs


def records(folder: Path, of: str) -> list[tuple[int, dict]]:
    """What is known of the attempts at a job, with Slurm's numbers, in their order."""
    files = (folder / "logs" / "slurm").glob("[0-9]*.json")
    found = sorted((int(file.stem), json.loads(file.read_text())) for file in files)
    return [(number, one) for number, one in found if of in one["names"]]


def begun(folder: Path, name: str) -> int:
    notes = folder / f"{name}.begun"
    return len(notes.read_text()) if notes.exists() else 0


def wait_for(what, seconds=60.0):
    until = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < until
        time.sleep(0.2)


class Call(threading.Thread):
    """Jobs handed to the cluster, while the test does something to them."""

    def __init__(self, jobs: dict[str, Job], folder: Path, profile: Path):
        super().__init__()
        self.told, self.failed = (jobs, folder, profile), [""]
        (folder / "logs").mkdir(parents=True, exist_ok=True)
        self.start()

    def run(self):
        self.failed = [str(one) for one in cluster.run(*self.told)]

    def end(self) -> list[str]:
        """What is told of the jobs that failed."""
        self.join(timeout=300.0)
        assert not self.is_alive()
        return self.failed


def test_a_node_that_fails(tmp_path, slurm):
    """Its job is started again by Slurm, without an attempt of ours."""
    jobs = made_up(tmp_path / "kept", ["stranded"])
    call = Call(jobs, tmp_path / "kept", profile(tmp_path))
    wait_for(lambda: begun(tmp_path / "kept", "stranded"))
    ((number, _),) = records(tmp_path / "kept", "stranded")
    slurm.ask("scontrol", "update", f"nodename={slurm.host}", "state=down", "reason=test")
    slurm.ask("scontrol", "update", f"nodename={slurm.host}", "state=resume")
    wait_for(lambda: slurm.states()[number] == "PENDING")
    slurm.ask("scontrol", "update", f"jobid={number}", "starttime=now")  # Slurm waits two minutes
    assert call.end() == []
    assert begun(tmp_path / "kept", "stranded") == 2
    assert [one["attempt"] for _, one in records(tmp_path / "kept", "stranded")] == [1]


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


def data(file: Path) -> bytes:
    """Every particle of the last frame, bit by bit."""
    with h5py.File(file) as run:
        last = run["data"][max(run["data"], key=int)]
        return last["particles/cloud/position/x"][()].tobytes()
