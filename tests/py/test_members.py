"""How far a workflow is: told from the files that its jobs make and the logs that they begin."""

import os
import re
import subprocess
import time

import pytest

from cases import case, members
from cases.members import MOST, Members, Watch, shown
from cases.programs import ROOT, module
from compare.study import sweep
from compare.study.recipe import Recipe

CI = ROOT / "cases" / "column_ci"


class Jobs:
    """Files as jobs leave them, at times of our own."""

    def __init__(self, folder, names, **more):
        (folder / "logs").mkdir()
        self.folder, self.began = folder, time.time()
        self.members = Members("jobs", {name: folder / f"{name}.out" for name in names}, **more)

    def watch(self) -> Watch:
        return Watch(self.members, self.folder / "logs", self.began)

    def begin(self, name, at=1.0):
        log = self.folder / "logs" / f"{name}.log"
        log.touch()
        os.utime(log, (self.began + at, self.began + at))

    def end(self, name):
        (self.folder / f"{name}.out").touch()


def test_members_that_run_count_by_what_they_should_take(tmp_path):
    jobs = Jobs(tmp_path, "ab", seconds={"a": 10.0, "b": 30.0})
    watch, now = jobs.watch(), jobs.began + 2.0
    assert watch.look(now) == (0.0, "0 of 2 done")
    jobs.begin("a")
    assert watch.look(now) == (0.0, "0 of 2 done, runs: a")
    share, _ = watch.look(now + 5.0)
    assert share == pytest.approx(5.0 / 40.0)
    assert watch.look(now + 1000.0)[0] == pytest.approx(MOST * 10.0 / 40.0)  # it is not done
    jobs.end("a")
    share, words = watch.look(now + 1000.0)
    assert (share, words) == (pytest.approx(0.25), "1 of 2 done")


def test_what_the_first_has_taken_is_what_the_others_take(tmp_path):
    """An estimate that was off by ten is so no longer, and none is needed."""
    estimates: list[dict[str, float]] = [{"a": 2.0, "b": 2.0}, {}]
    for seconds in estimates:
        folder = tmp_path / str(len(seconds))
        folder.mkdir()
        jobs = Jobs(folder, "ab", seconds=seconds)
        watch, now = jobs.watch(), jobs.began + 2.0
        jobs.begin("a")
        first, _ = watch.look(now)
        assert first == 0.0
        jobs.end("a")
        watch.look(now + 20.0)
        jobs.begin("b")
        watch.look(now + 20.0)
        assert watch.look(now + 30.0)[0] == pytest.approx(0.75)  # ten seconds of twenty


def test_what_was_there_before_is_done_and_no_work(tmp_path):
    jobs = Jobs(tmp_path, "abc", labels={"b": "the second"})
    jobs.end("a")
    jobs.begin("c", at=-60.0)  # the log of an earlier call
    watch = jobs.watch()
    assert watch.look(jobs.began + 2.0) == (0.0, "1 of 3 done")
    jobs.begin("b")
    assert watch.look(jobs.began + 2.0) == (0.0, "1 of 3 done, runs: the second")
    jobs.end("b")
    assert watch.look(jobs.began + 3.0)[0] == pytest.approx(0.5)


def test_a_line_for_each_tenth_and_none_when_quiet(tmp_path, capsys):
    for quiet in (False, True):
        folder = tmp_path / str(quiet)
        folder.mkdir()
        jobs = Jobs(folder, "ab", quiet=quiet)
        with shown(jobs.members, folder / "logs", jobs.began):
            jobs.end("a")
            time.sleep(1.2)  # two looks
            jobs.end("b")
        said = [re.sub(r" after.*: ", ": ", line) for line in capsys.readouterr().err.splitlines()]
        lines = ["jobs: 0 %: 0 of 2 done", "jobs: 50 %: 1 of 2 done", "jobs: 100 %: 2 of 2 done"]
        assert said == ([] if quiet else lines)


def test_nothing_is_said_of_what_is_there(tmp_path, capsys):
    jobs = Jobs(tmp_path, "a")
    jobs.end("a")
    with shown(jobs.members, tmp_path / "logs", jobs.began):
        pass
    assert capsys.readouterr() == ("", "")


def test_an_ensemble_says_how_far_it_is(tmp_path, monkeypatch):
    """In lines, as `progress` lines alone, and not at all when all is there or it is to be quiet.

    Two packings, of a collapse that is cut short.
    """
    monkeypatch.setenv("GRAINPAIR_RUNS", str(tmp_path / "runs"))
    words = [CI, "--seeds", 2, "--jobs", 1, "--table", tmp_path / "t.csv"]
    words += ["--set", "time.maximum=0.25"]

    def ensemble(*more) -> subprocess.CompletedProcess:
        command = module("dem_reference.ensemble", *words, *more)
        return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, timeout=600)

    first = ensemble()
    assert first.returncode == 0, first.stderr
    lines = first.stderr.splitlines()
    assert all(re.match(r"seeds of the grains: \d+ % after ", line) for line in lines)
    shares = [int(line.split()[4]) for line in lines]
    assert shares == sorted(shares) and (shares[0], shares[-1]) == (0, 100)
    assert lines[0].endswith("0 of 2 done") and lines[-1].endswith("2 of 2 done")
    assert any("seed 1" in line or "seed 2" in line for line in lines)
    again = ensemble()
    assert (again.returncode, again.stderr) == (0, "")
    assert again.stdout == first.stdout  # the table's figures

    for file in (tmp_path / "runs").glob("ensembles/*/*/2.h5"):
        file.unlink()
    told = ensemble("--progress")
    assert (told.returncode, told.stderr) == (0, "")
    rows = [line.split(maxsplit=2) for line in told.stdout.splitlines()]
    assert all(row[0] == "progress" for row in rows)
    fractions = [float(row[1]) for row in rows]
    assert fractions == sorted(fractions) and (fractions[0], fractions[-1]) == (0.0, 1.0)
    assert rows[0][2] == "1 of 2 done"

    for file in (tmp_path / "runs").glob("ensembles/*/*/2.h5"):
        file.unlink()
    assert ensemble("--quiet").stderr == ""


def test_a_failure_is_the_last_line_and_nothing_goes_on(tmp_path, monkeypatch):
    monkeypatch.setenv("GRAINPAIR_RUNS", str(tmp_path / "runs"))
    words = [CI, "--seeds", 1, "--table", tmp_path / "t.csv"]
    words += ["--set", "geometry.thickness=0.003"]  # refused once the job has begun
    command = module("dem_reference.ensemble", *words)
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, timeout=600)
    assert done.returncode == 3 and "less than 2 grain diameters" in done.stderr.splitlines()[-1]
    assert "100 %" not in done.stderr


def test_every_command_of_many_runs_can_be_quiet():
    from compare.shell.surface import commands

    flags = {one.name: {flag for arg in one.options for flag in arg.flags} for one in commands()}
    for name in ("frontier", "ladder", "atlas", "convergence", "error-bar", "judge", "element"):
        assert "--quiet" in flags[name], name


def test_a_study_says_what_its_runs_are(tmp_path, monkeypatch, capsys):
    """By their recipes; asked again there is nothing to wait for, nor to say."""

    class Options:
        jobs, profile, quiet = 1, None, False

    monkeypatch.setenv("GRAINPAIR_RUNS", str(tmp_path))
    monkeypatch.setattr(members, "INTERVAL", 0.02)  # runs of a tenth of a second are seen
    sets = [("mpm.cell_size=0.005", f"time.maximum={end}") for end in (0.5, 0.25)]
    recipes = [Recipe("mpm", words, "test", timeout=30.0) for words in sets]
    points = sweep.run_recipes(case.load(CI), recipes, Options)
    assert [point["status"] for point in points] == ["ok", "ok"]
    said = capsys.readouterr().err.splitlines()
    assert said[0].startswith("runs of the study: 0 % after")
    assert "100 % after" in said[-1] and said[-1].endswith("2 of 2 done")
    assert any("runs: cell size 0.005, maximum 0." in line for line in said)
    again = sweep.run_recipes(case.load(CI), recipes, Options)
    assert again == points and capsys.readouterr().err == ""


def test_a_longer_run_is_estimated_longer_and_a_refused_one_not_at_all():
    scene = case.load(CI)
    short, long = (
        sweep.estimate(scene, Recipe("mpm", (f"time.maximum={end}",))) for end in (1.0, 4.0)
    )
    assert short and long
    assert long.seconds == pytest.approx(
        4.0 * short.seconds, rel=0.1
    )  # steps of one length, and a constant
    assert sweep.estimate(scene, Recipe("mpm", ("mpm.cell_size=-1",))) is None
