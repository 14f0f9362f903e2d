"""A machine that loses power with all of Slurm on it, and is started anew."""

import json
import subprocess
from pathlib import Path

import pytest

import slurm_here
from bits import bits
from cases.jobs import Job
from cases.programs import ROOT, module
from slurm_jobs import Call, begun, made_up, profile, records, wait_for

pytest.importorskip("snakemake")
SETS = ["time.maximum=2.5", "dem.packing_attempts=1", "dem.void_ratio_tolerance=0.2"]
GRAINS = ["cases/column_ci", *(word for one in SETS for word in ("--set", one)), "--quiet"]
OFTEN = ["--set", "output.checkpoint_interval=0.01"]
# As a container's program would be: the first time jobs wait until they are old enough to be put
# back, as those of a machine that takes its time to start are.
SLOWLY = """#!/bin/sh
test -e {mark} || sleep {seconds}
touch {mark}
shift 2
exec "$@"
"""


@pytest.fixture
def slurm(monkeypatch):
    with slurm_here.running() as here:
        here.is_told_to(monkeypatch)
        yield here


def slow(folder: Path, seconds: float) -> Path:
    """A profile whose jobs begin with a pause."""
    program = folder / "slowly"
    program.write_text(SLOWLY.format(mark=folder / "paused", seconds=seconds))
    program.chmod(0o755)
    (folder / "slow").mkdir()
    return profile(folder / "slow", container="image", runtime=str(program))


def contents(path: Path) -> dict[str, bytes]:
    """Of a result, but what tells of how often it was kept."""
    apart = ("@case", "@case_resolved", "@command")
    return {place: one for place, one in bits(path).items() if place not in apart}


def test_a_reboot(tmp_path, slurm, monkeypatch):
    """Of two calls one lives elsewhere and waits, the other's machine dies, too, and it is given
    again. A third wants to hand a job in meanwhile.
    """
    monkeypatch.setenv("GRAINPAIR_RUNS", str(tmp_path / "runs"))
    folder, new = tmp_path / "kept", tmp_path / "new"
    jobs = made_up(folder, ["fine", "stranded"])
    whole = folder / "whole.h5"
    jobs["whole"] = Job(
        whole, ("dem_reference.run", *GRAINS, "-o", str(whole)), seconds=901.0, bytes=1.0
    )
    where, slowly = profile(tmp_path), slow(tmp_path, slurm_here.OLD)
    lives = Call(jobs, folder, where)
    words = [*GRAINS, *OFTEN, "--seeds", 1, "--profile", slowly, "--table", tmp_path / "t.csv"]
    command = module("dem_reference.ensemble", *words)
    dies = subprocess.Popen(command, cwd=ROOT, start_new_session=True, stderr=subprocess.DEVNULL)
    seeds = tmp_path / "runs" / "ensembles" / "column_ci"
    wait_for(lambda: (folder / "fine.txt").exists() and begun(folder, "stranded"))
    wait_for(lambda: [*seeds.glob("*/1.h5.unfinished/checkpoint-*.h5")])
    slurm.lose_power(dies.pid)
    assert not (folder / "stranded.txt").exists() and not [*seeds.glob("*/1.h5")]

    (new / "logs" / "slurm").mkdir(parents=True)
    (new / "logs" / "slurm" / "0.json").write_text(json.dumps({"bundle": "earlier"}))
    comes = Call(made_up(new, ["fine"]), new, where)
    slurm.start(again=True)
    ((number, _),) = records(folder, "stranded")
    put_back = [number, *(one for one, name in slurm.names().items() if name == "grainpair-1")]
    wait_for(lambda: all(slurm.states()[one] == "PENDING" for one in put_back))
    again = subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True)
    for one, state in slurm.states().items():
        if state == "PENDING":
            slurm.hurry(one, "now+2")
    with again:
        assert again.communicate()[1] == "" and again.returncode == 0
    assert (lives.end(), comes.end()) == ([], [])

    # all is made once, by the job of the first attempt, and Slurm has had no other
    assert [begun(folder, name) for name in ("fine", "stranded")] == [1, 2]
    for name in jobs:
        assert [one["attempt"] for _, one in records(folder, name)] == [1]
    assert sorted(slurm.names().values()) == sorted(
        f"grainpair-{name}" for name in (*jobs, "fine", "1")
    )
    assert set(slurm.states().values()) == {"COMPLETED"}
    # the grains have gone on, to the same bits
    (made,), (log,) = seeds.glob("*/1.h5"), seeds.glob("*/logs/1.log")
    assert ": goes on from t = " in log.read_text()
    assert contents(made) == contents(whole)
