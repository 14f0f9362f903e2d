"""Ensembles and studies killed at any moment: ten seconds later nothing of theirs is alive,
and the same command again ends with what it would have made undisturbed.

GRAINPAIR_KILLS=N kills each of them N times (CI: a handful in all), GRAINPAIR_KILLS_SEED=S chooses
other moments.
"""

import os
import random
import signal
import time
from pathlib import Path

import pandas as pd
import pytest

from bits import bits
from cases.programs import PYTHON, ROOT
from cases.scratch import take
from killed import GENTLE, PATIENCE, SIGNALS, Place, kill, run
from watched import seen

CI = ROOT / "cases" / "column_ci"
SHORT = "time.maximum=0.25"  # of an ensemble and a study that take seconds
MOST = 5.0  # [s] of the moments: an ensemble with its packings and a study take about as long
STUDY = """
[error_bar]
timeout = 60.0
[[error_bar.scene]]
name = "pic"
fine = 0.0025
set."mpm.cell_size" = 0.003
set."mpm.transfer" = "pic"
"""
ASKED = int(os.environ.get("GRAINPAIR_KILLS", "0"))
ENSEMBLES = [SIGNALS[k % 3] for k in range(ASKED or 3)]
STUDIES = [SIGNALS[k % 3] for k in range(ASKED or 1)]
random.seed(os.environ.get("GRAINPAIR_KILLS_SEED", "1"))
MOMENTS = {(kind, k): MOST * random.random() for kind in "es" for k in range(max(ASKED, 3))}


def made(place: Place) -> dict:
    """All that the command has made, without what tells of when and at what cost."""
    table = pd.read_csv(place.table, comment="#")
    out: dict = {"table": table[[name for name in table if "cpu_seconds" not in name]]}
    for path in sorted(place.runs.glob("ensembles/*/*/*.h5")):
        out[path.name] = bits(path)
    return out


def same(one: dict, other: dict) -> bool:
    return one.keys() == other.keys() and all(
        one[name].equals(other[name]) if name == "table" else one[name] == other[name]
        for name in one
    )


def ensemble(folder: Path, packings: Path) -> Place:
    words = [
        "dem_reference.ensemble",
        CI,
        "--quiet",
        "--seeds",
        2,
        "--jobs",
        2,
        "--set",
        SHORT,
        "--table",
    ]
    return Place(folder, packings, words, "table.csv")


def study(folder: Path, packings: Path) -> Place:
    scene = folder / "scene"
    scene.mkdir(parents=True)
    (scene / "case.toml").write_text(f'extends = "{CI}/case.toml"\n[time]\nmaximum = 0.25\n')
    (scene / "study.toml").write_text(STUDY)
    words = ["compare", "error-bar", scene, "--quiet", "--jobs", 2, "--out"]
    return Place(folder, packings, words, "out/error_bar.csv")


@pytest.fixture(scope="module")
def packings(tmp_path_factory):
    return tmp_path_factory.mktemp("packings")


@pytest.fixture(scope="module")
def of_ensemble(tmp_path_factory, packings):
    """What an ensemble makes that nobody kills."""
    place = ensemble(tmp_path_factory.mktemp("undisturbed") / "e", packings)
    run(place)
    return made(place)


@pytest.fixture(scope="module")
def of_study(tmp_path_factory, packings):
    place = study(tmp_path_factory.mktemp("undisturbed") / "s", packings)
    run(place)
    return made(place)


def kill_once(place: Place, number: signal.Signals, moment: float):
    """And looks at what stays."""
    code, said = kill(place, number, moment)
    if code > 0:  # those that were told while Python had not begun with us end without
        assert len(said.splitlines()) <= 1 and not place.left(), (said, place.left())


@pytest.mark.parametrize("k", range(len(ENSEMBLES)))
def test_a_killed_ensemble_leaves_nobody_and_goes_on(tmp_path, packings, of_ensemble, k):
    place = ensemble(tmp_path / "e", packings)
    kill_once(place, ENSEMBLES[k], MOMENTS["e", k])
    run(place)
    assert same(made(place), of_ensemble)


@pytest.mark.parametrize("k", range(len(STUDIES)))
def test_a_killed_study_leaves_nobody_and_goes_on(tmp_path, packings, of_study, k):
    place = study(tmp_path / "s", packings)
    kill_once(place, STUDIES[k], MOMENTS["s", k])
    run(place)
    assert same(made(place), of_study)


@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: number.name)
def test_engines_that_have_minutes_to_go_end_with_their_driver(tmp_path, packings, number):
    """Those of short runs might be ready before anybody looks."""
    place = ensemble(tmp_path / "e", packings)
    place.command += ["--set", "dem.time_step_fraction=0.01", "--set", "time.maximum=20.0"]
    one, began = place.start(), time.monotonic()
    while sum("spawn_main" in words for words in place.alive()) < 2:  # a LIGGGHTS of each seed
        assert one.poll() is None and time.monotonic() - began < 60.0
        time.sleep(0.1)
    one.send_signal(number)
    began = time.monotonic()
    assert one.wait(timeout=PATIENCE) in GENTLE[number]
    while (alive := place.alive()) and time.monotonic() - began < PATIENCE:
        time.sleep(0.1)
    for process in alive:
        os.kill(int(process.split()[0]), signal.SIGKILL)
    assert not alive, alive
    assert number == signal.SIGKILL or not place.left()


def test_what_a_driver_leaves_behind_would_be_seen(tmp_path, packings, of_ensemble, monkeypatch):
    """The control: a driver that orphans, and results that differ by one number."""
    place = ensemble(tmp_path / "e", packings)
    orphan = "import subprocess, sys; subprocess.run(['sleep', '60'], start_new_session=True)"
    place.command = [PYTHON, "-c", orphan]
    monkeypatch.setattr("killed.PATIENCE", 1.0)
    with pytest.raises(AssertionError, match="sleep 60"):
        kill(place, signal.SIGKILL, 0.5)
    for one in place.alive():
        os.kill(int(one.split()[0]), signal.SIGKILL)
    other = of_ensemble | {"table": of_ensemble["table"] * (1 + 1e-12)}
    assert same(of_ensemble, dict(of_ensemble)) and not same(of_ensemble, other)


def test_a_folder_in_use_is_refused_and_that_of_a_dead_process_is_not(tmp_path, packings):
    place = ensemble(tmp_path / "e", packings)
    first = place.start()
    while not (locks := seen(place.runs, "ensembles/*/*/lock")):
        assert first.poll() is None
        time.sleep(0.05)
    second = place.start()
    assert second.wait(timeout=60) == 2
    said = place.said.read_text()
    assert said.count("\n") == 1, said
    assert said.startswith(f"{locks[0].parent}: in use by process {first.pid} (started ")
    first.kill()
    first.wait()
    free = take(locks[0])
    assert free is not None
    os.close(free)
