"""Ranks in a job of Slurm's: their result is that of ranks on this machine, and none outlives its
job.
"""

import importlib.util
import os
import shutil
import signal
import subprocess
from pathlib import Path

import pytest

import slurm_here
from bits import bits
from cases import pool
from cases.jobs import Job
from cases.programs import ROOT, module, program
from slurm_jobs import Call, profile, records, wait_for

pytest.importorskip("snakemake")
pytestmark = pytest.mark.skipif(
    not program("mpm_run_ranks").exists()
    or not shutil.which("mpirun")
    or not importlib.util.find_spec("mpi4py"),
    reason="no MPI (packages-cluster.txt)",
)
SETS = ["mpm.cell_size=0.001", "dem.packing_attempts=1", "dem.void_ratio_tolerance=0.2"]
SCENE = ["cases/column_ci", *(word for one in SETS for word in ("--set", one))]
SHORT = ["--set", "time.maximum=0.3"]
LONG = ["--set", "time.maximum=1000", "--set", "time.rest_kinetic_energy=0"]
APART = {"@command", "@case", "@created", "@cpu_seconds", "@wall_seconds"}


@pytest.fixture(scope="module")
def slurm():
    with slurm_here.running() as here:
        yield here


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    return tmp_path_factory.mktemp("runs")


@pytest.fixture(autouse=True)
def told(slurm, runs, monkeypatch):
    slurm.is_told_to(monkeypatch)
    monkeypatch.setenv("GRAINPAIR_RUNS", str(runs))


def continuum(file: Path, *more: str) -> Job:
    words = ("mpm_run", *SCENE, *more, "--ranks", "2", "--quiet", "-o", str(file))
    return Job(file, words, cores=2, seconds=901.0, bytes=1.0)


def grains(file: Path, *more: str) -> Job:
    words = ("dem_reference.run", *SCENE, *more, "--ranks", "2", "--quiet", "-o", str(file))
    return Job(file, words, cores=2, seconds=901.0, bytes=1.0)


def of_job(slurm, number: int, words: str = "") -> list[int]:
    """Processes on this machine that belong to a job and have the words in their command line."""
    marks = {f"SLURM_CONF={slurm.folder}/slurm.conf".encode(), f"SLURM_JOB_ID={number}".encode()}
    found = []
    for one in Path("/proc").glob("[0-9]*"):
        try:
            if marks <= set((one / "environ").read_bytes().split(b"\0")):
                if words in (one / "cmdline").read_bytes().replace(b"\0", b" ").decode():
                    found.append(int(one.name))
        except OSError:  # it has ended meanwhile
            continue
    return found


def test_ranks_of_a_job_make_what_ranks_here_make(tmp_path, slurm, runs):
    """Of the continuum as a job, of the grains as an ensemble of one seed."""
    there, here = tmp_path / "there", tmp_path / "here"
    where = profile(tmp_path)
    call = Call({"continuum": continuum(there / "mpm.h5", *SHORT)}, there, where)
    words = [*SCENE, *SHORT, "--seeds", 1, "--ranks", 2, "--quiet", "--table", tmp_path / "t.csv"]
    command = module("dem_reference.ensemble", *words, "--profile", where)
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=90)
    assert (done.returncode, done.stderr) == (0, "")
    assert call.end() == []
    assert set(slurm.states().values()) == {"COMPLETED"}
    # of two processors each
    told = slurm.ask("squeue", "--noheader", "--states=all", "--format=%C %D").splitlines()
    assert [line.split() for line in told] == [["2", "1"]] * 2
    (here / "logs").mkdir(parents=True)
    jobs = {"mpm": continuum(here / "mpm.h5", *SHORT), "dem": grains(here / "dem.h5", *SHORT)}
    assert pool.run(jobs, here / "logs", 2) == []
    (seed,) = (runs / "ensembles").glob("*/*/1.h5")
    for ours, theirs in ((here / "mpm.h5", there / "mpm.h5"), (here / "dem.h5", seed)):
        a, b = bits(ours), bits(theirs)
        assert a.keys() == b.keys()
        assert {name for name in a if a[name] != b[name]} <= APART
    # which is not what one rank makes: sums run in another order
    one = here / "one.h5"
    alone = Job(one, ("mpm_run", *SCENE, *SHORT, "--quiet", "-o", str(one)), 1)
    assert pool.run({"one": alone}, here / "logs", 1) == []
    a, b = bits(alone.file), bits(there / "mpm.h5")
    assert not {name for name in b if a.get(name) != b[name]} <= APART


def test_no_rank_outlives_its_job(tmp_path, slurm):
    """One that is killed ends them all; so do the end of the job's time, and scancel."""
    folder = tmp_path / "kept"
    jobs = {"mpm": continuum(folder / "mpm.h5", *LONG), "dem": grains(folder / "dem.h5", *LONG)}
    call = Call(jobs, folder, profile(tmp_path))
    wait_for(lambda: records(folder, "mpm") and records(folder, "dem"))
    numbers = {name: records(folder, name)[0][0] for name in jobs}
    programs = {"mpm": "mpm_run_ranks", "dem": "dem_reference.ranks"}

    def ranks(name: str) -> list[int]:
        """Without mpirun, which names their program, too."""
        there = of_job(slurm, numbers[name], programs[name])
        return [one for one in there if command_of(one) != "mpirun"]

    for name in jobs:
        wait_for(lambda: len(ranks(name)) == 2)
    os.kill(ranks("mpm")[0], signal.SIGKILL)  # as the kernel does where memory runs out
    slurm.ask("scontrol", "update", f"jobid={numbers['dem']}", "endtime=now")
    for name in jobs:
        wait_for(lambda: not of_job(slurm, numbers[name]))
        wait_for(lambda: len(records(folder, name)) == 2)  # handed in again
        numbers[name] = records(folder, name)[1][0]
        wait_for(lambda: len(ranks(name)) == 2)
        slurm.ask("scancel", str(numbers[name]))
        wait_for(lambda: not of_job(slurm, numbers[name]))
    said = call.end()
    assert len(said) == 2 and all("cancelled at attempt 2" in line for line in said)
    assert not list(folder.glob("*.h5"))
    ended = {name: [one["state"] for _, one in records(folder, name)] for name in jobs}
    assert ended == {"mpm": ["FAILED", "CANCELLED"], "dem": ["TIMEOUT", "CANCELLED"]}


def command_of(process: int) -> str:
    try:
        return Path(f"/proc/{process}/comm").read_text().strip()
    except OSError:
        return "mpirun"  # it has ended
