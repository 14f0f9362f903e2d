"""Many jobs: what stops them is one line, what was made is kept, and no text of a case reaches a
shell.
"""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from cases import pool, workflow
from cases.errors import CaseError, EngineError
from cases.jobs import Job
from cases.members import Members
from cases.programs import PYTHON, ROOT, module
from cases.scratch import take
from played_cluster import profile

CI = ROOT / "cases" / "column_ci"
JOB = """
import os, sys, time
from pathlib import Path
file, seconds, failing = Path(sys.argv[1]), float(sys.argv[2]), sys.argv[3] == "fails"
with open(file.parent / "began", "a") as began:
    began.write(f"{file.stem} {time.monotonic()}\\n")
time.sleep(seconds)
if failing:
    sys.exit(f"engine: job {file.stem} lost its grains (a made-up reason)")
if sys.argv[3] == "dies":
    os.kill(os.getpid(), 11)
if sys.argv[3] == "works":
    file.write_text("made")
with open(file.parent / "ended", "a") as ended:
    ended.write(f"{file.stem} {time.monotonic()}\\n")
"""


@pytest.fixture
def make(tmp_path, monkeypatch):
    """Runs jobs by name in one folder; what becomes of them is told by their names."""
    (tmp_path / "made_up.py").write_text(JOB)
    folder, script = tmp_path / "kept", str(tmp_path / "made_up.py")
    monkeypatch.setattr("cases.jobs.module", lambda *words: [PYTHON, script, *words])

    class Make:
        def __init__(self):
            self.folder = folder

        def jobs(self, names, cores=1, seconds=0.0, **fates):
            return {
                name: Job(
                    folder / f"{name}.txt",
                    (str(folder / f"{name}.txt"), str(seconds), fates.get(name, "works")),
                    cores,
                )
                for name in names
            }

        def __call__(self, names, at_once=2, alone=False, **more):
            jobs = self.jobs(names, **more)
            members = Members("jobs", {name: job.file for name, job in jobs.items()}, quiet=True)
            workflow.run(jobs, folder, workflow.Where(at_once), members, alone=alone)

        def times(self, what) -> dict:
            lines = (folder / what).read_text().splitlines()
            return {name: float(at) for name, at in (line.split() for line in lines)}

        def begun(self) -> list[str]:
            return [line.split()[0] for line in (folder / "began").read_text().splitlines()]

    return Make()


def test_a_job_that_fails_is_told_in_one_line_and_taken_up_again(make):
    with pytest.raises(EngineError, match="^engine: job b lost its grains .*logs/b.log") as error:
        make("abc", b="fails")
    assert "\n" not in str(error.value)
    assert (make.folder / "c.txt").exists()  # the others are done nevertheless
    made = (make.folder / "a.txt").stat().st_mtime_ns
    make("abc")
    assert (make.folder / "b.txt").read_text() == "made"
    assert (make.folder / "a.txt").stat().st_mtime_ns == made
    assert make.begun() == ["a", "b", "c", "b"]


@pytest.mark.parametrize(
    "fate, said", [("dies", "killed by SIGSEGV"), ("idles", "ended with code 0, .* without a word")]
)
def test_a_job_without_a_word_is_told_too(make, fate, said):
    with pytest.raises(EngineError, match=f"^a: {said} .see "):
        make("a", a=fate)


@pytest.mark.parametrize("cores, together", [(1, 2), (2, 1), (3, 1)])
def test_as_many_run_at_a_time_as_there_are_cores_for(make, cores, together):
    make("abcd", at_once=2, cores=cores, seconds=0.3)
    began, ended = make.times("began"), make.times("ended")
    most = max(sum(began[one] <= began[other] < ended[one] for one in began) for other in began)
    assert most == together


def test_those_that_take_longest_begin_first(make):
    jobs = make.jobs("abc", seconds=0.1)
    files = {name: job.file for name, job in jobs.items()}
    seconds = {"a": 1.0, "b": 3.0, "c": 2.0}
    members = Members("jobs", files, seconds=seconds, quiet=True)
    workflow.run(jobs, make.folder, workflow.Where(1), members)
    assert make.begun() == ["b", "c", "a"]


def test_two_calls_make_what_they_share_once(make):
    def call():
        jobs = make.jobs("abcd", seconds=0.3)
        (make.folder / "logs").mkdir(parents=True, exist_ok=True)
        assert not pool.run(jobs, make.folder / "logs", 1)

    # threads: jobs are bound to the thread that starts them, which here lives as long as its call
    callers = [threading.Thread(target=call) for _ in range(2)]
    for one in callers:
        one.start()
    for one in callers:
        one.join()
    assert sorted(make.begun()) == list("abcd")


def test_what_another_call_leaves_undone_is_done(make):
    """Whoever does a job holds its log's lock; without that both would do it."""
    (make.folder / "logs").mkdir(parents=True)
    other = take(make.folder / "logs" / "a.log")
    assert other is not None
    threading.Timer(0.5, os.close, [other]).start()
    began = time.monotonic()
    make("a")
    assert 0.5 <= time.monotonic() - began and (make.folder / "a.txt").exists()


def test_a_call_may_have_the_folder_for_itself(make):
    make.folder.mkdir()
    other = take(make.folder / "lock")
    assert other is not None
    with pytest.raises(CaseError, match="in use by"):
        make("a", alone=True)
    make("a")


def test_who_is_interrupted_ends_its_jobs(make):
    """They would take ten seconds more."""
    jobs = make.jobs("ab", seconds=10.0)
    (make.folder / "logs").mkdir(parents=True)
    began = time.monotonic()
    previous = signal.signal(signal.SIGALRM, lambda *_: sys.exit(1))
    signal.setitimer(signal.ITIMER_REAL, 1.0)
    try:
        with pytest.raises(SystemExit):
            pool.run(jobs, make.folder / "logs", 2)
    finally:
        signal.signal(signal.SIGALRM, previous)
    assert time.monotonic() - began < 4.0
    assert sorted(make.begun()) == ["a", "b"] and not (make.folder / "ended").exists()
    assert all(take(make.folder / "logs" / f"{name}.log") is not None for name in "ab")


@pytest.fixture
def cluster(tmp_path):
    pytest.importorskip("snakemake")
    return workflow.Where(1, profile(tmp_path))


def test_a_cluster_makes_the_same(tmp_path, cluster):
    """Job b is refused by its program, in the words that it has on this machine."""
    folder, words = tmp_path / "kept", (str(CI), "--quiet", "--set", "time.maximum=0.05")
    jobs = {
        name: Job(
            folder / f"{name}.h5",
            ("dem_reference.run", *words, *more, "-o", str(folder / f"{name}.h5")),
        )
        for name, more in (("a", ()), ("b", ("--set", "geometry.thickness=0.003")))
    }
    members = Members("jobs", {name: job.file for name, job in jobs.items()}, quiet=True)
    for where in (cluster, workflow.Where(2)):
        with pytest.raises(EngineError, match="less than 2 grain diameters.*logs/b.log") as error:
            workflow.run(jobs, folder, where, members)
        assert "\n" not in str(error.value)
        assert jobs["a"].file.exists() and not jobs["b"].file.exists()
        assert not list(folder.glob("jobs-*"))
        jobs["a"].file.unlink()


def test_a_cluster_that_cannot_start_is_told_in_one_line(tmp_path, cluster):
    assert cluster.profile
    (cluster.profile / "config.yaml").write_text("cluster: [nonsense\n")
    jobs = {"a": Job(tmp_path / "a.h5", ("dem_reference.run",))}
    members = Members("jobs", {"a": tmp_path / "a.h5"}, quiet=True)
    with pytest.raises(EngineError, match="^snakemake: stopped") as error:
        workflow.run(jobs, tmp_path, cluster, members)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("title", ["'; touch X; '", '\\"; touch X; \\"', "$(touch X)", "`touch X`"])
def test_no_text_of_a_case_reaches_a_shell(tmp_path, monkeypatch, title):
    monkeypatch.setenv("GRAINPAIR_RUNS", str(tmp_path / "runs"))
    words = ["--seeds", "1", "--quiet", "--set", f'title="{title}"', "--table", tmp_path / "t.csv"]
    # refused once the job has begun, which is all that is needed here
    words += ["--set", "geometry.thickness=0.003"]
    command = module("dem_reference.ensemble", CI, *words)
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 3 and "less than 2 grain diameters" in done.stderr, done.stderr
    assert done.stderr.count("\n") == 1
    assert not [*tmp_path.rglob("X"), *ROOT.glob("X"), *ROOT.glob("runs/**/X")]
