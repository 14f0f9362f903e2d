"""A run that is killed again and again, and started again, until it is done: its engines' results
are those of one that nobody killed, bit by bit, and nothing else is left.

GRAINPAIR_KILLS=N kills runs N times in all (CI: a few), GRAINPAIR_KILLS_SEED=S chooses other
moments.
"""

import os
import random

import pytest

from cases.programs import ROOT
from bits import differences
from killed import SIGNALS, Place, kill, run

KILLS = int(os.environ.get("GRAINPAIR_KILLS", "3"))
MOST = 2.0  # [s] of a moment
RESULTS = ("mpm.h5", "dem.h5", "siblings/coarse.h5", "siblings/slow.h5")


def place(folder, packings) -> Place:
    sets = ("time.maximum=1.5", "output.checkpoint_interval=0.1")
    words = ["compare", "run", ROOT / "cases" / "column_ci", "--quiet"]
    for one in sets:
        words += ["--set", one]
    return Place(folder, packings, [*words, "--out"], "out/metrics.json")


def at_work(one: Place):
    """Whether an engine has kept itself once more."""
    known = kept(one)
    return lambda: not kept(one) <= known


def kept(one: Place) -> set:
    """By name and folder; folders come and go."""
    found = (
        {f"{folder}/{name}" for name in names if name.startswith("checkpoint-")}
        for folder, _, names in os.walk(one.folder)
    )
    return set().union(*found)


@pytest.fixture(scope="module")
def packings(tmp_path_factory):
    return tmp_path_factory.mktemp("packings")


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory, packings):
    one = place(tmp_path_factory.mktemp("undisturbed") / "run", packings)
    run(one)
    return one.table.parent


def test_a_run_killed_again_and_again_ends_as_if_nobody_had(tmp_path, packings, undisturbed):
    moments, kills, runs, went_on = (
        random.Random(os.environ.get("GRAINPAIR_KILLS_SEED", "1")),
        0,
        0,
        0,
    )
    while kills < KILLS:
        one = place(tmp_path / f"run_{runs}", packings)
        runs += 1
        while kills < KILLS:
            number = SIGNALS[kills % 3]
            # every other one early, in what comes before the engines
            begun = at_work(one) if kills % 2 == 0 else lambda: True
            code, said = kill(one, number, MOST * moments.random(), begun)
            went_on += "goes on from where it was stopped" in said
            if code == 0:
                break
            kills += 1
        run(one)
        went_on += "goes on from where it was stopped" in one.said.read_text()
        for name in RESULTS:
            assert not differences(undisturbed / name, one.table.parent / name), (name, kills)
        assert {path.name for path in one.folder.iterdir()} == {"out", "runs", "said", "tmp"}
    print(f"{kills} kills of {runs} runs, gone on with {went_on} times")
    assert went_on > 0
