"""Grains that are shared among ranks: the accounts are those of one rank.

Sums of forces run in another order there, so trajectories part by round-off, which a collision
multiplies about tenfold; up to half of the free fall's time that is nothing yet (SAME).
"""

import importlib.util
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest

from cases.case import load
from cases.errors import CaseError, EngineError
from cases.programs import ROOT
from dem_reference import packing, scaling, shared
from dem_reference.checkpoint import Unfinished
from dem_reference.collapse import collapse
from dem_reference.grains import Grains
from dem_reference.process import Interrupted, run_engine
from dem_reference.ranks import outside_of_mpi, run_on_ranks
from dem_reference.run import main
from dem_reference.shared import Grid, grid_of
from killed import PATIENCE, Place

# by its full name, by which ranks find it
ranked = importlib.import_module("tests.py.ranked")
HAS_MPI = importlib.util.find_spec("mpi4py") is not None
needs_mpi = pytest.mark.skipif(not HAS_MPI, reason="python3-mpi4py is not installed")
CASE = "cases/column_ci"
# 780 steps, in which a grain of a dense packing meets some ten others: 1e-16 becomes 1e-12 of
# a place and 1e-11 of what a grain has dissipated, as measured; a hundred times that is allowed.
SHORT = ["time.maximum=0.5"]
SAME = 1e-9
EVERY = [*SHORT, "dem.audit_interval=1", "time.frame_interval=0.05"]
REAL = ["grains.size_spread=0.2", "grains.rolling_friction=0.1", "dem.packing_attempts=1"]


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return tmp_path_factory.mktemp("packings")


def made(folder: Path, store: Path, ranks: int, sets: list[str], work=shared.collapse) -> Path:
    """The result of a collapse, of one rank by the driver of one."""
    tables = packing.dict_of(load(CASE, sets))
    settled = packing.obtain(tables, 1, store, lambda done, text: None)
    folder.mkdir()
    target, log = folder / "dem.h5", folder / "log"
    words = tables, settled, log, target, {"seed": 1}, Unfinished.of(target)
    if ranks == 1:
        run_engine(collapse, *words, None, log=log)
    else:
        run_on_ranks(work, *words, ranks=ranks, log=log)
    return target


@pytest.fixture(scope="module")
def every(tmp_path_factory, store):
    """One rank and two, every step audited; the border wanders, so that grains change hands."""
    folder = tmp_path_factory.mktemp("every")
    works = {1: None, 2: ranked.wandering}
    return tuple(made(folder / str(n), store, n, EVERY, work) for n, work in works.items())


def history(path: Path) -> dict[str, np.ndarray]:
    with h5py.File(path) as file:
        return {name: values[()] for name, values in file["energy"].items()}


def same(one: Path, other: Path) -> list[str]:
    """What differs of two results, by its name."""
    found = []
    with h5py.File(one) as a, h5py.File(other) as b:
        scale = np.ptp(a["energy/potential"][()])
        for name in a["energy"]:
            if np.abs(a["energy"][name][()] - b["energy"][name][()]).max() > SAME * scale:
                found.append(name)
        if not np.array_equal(a["lifetime/contacts"][()], b["lifetime/contacts"][()]):
            found.append("contacts")
        for name in (n for n in a["lifetime"] if n.startswith("dissipated")):
            if np.abs(a["lifetime"][name][()] - b["lifetime"][name][()]).max() > SAME * scale:
                found.append(f"lifetime {name}")
        assert list(a["data"]) == list(b["data"])
        for step in a["data"]:
            heat = [file[f"data/{step}/particles/cloud/dissipated"][()] for file in (a, b)]
            if np.abs(heat[0] - heat[1]).max() > SAME * max(np.abs(heat[0]).max(), 1e-3 * scale):
                found.append(f"heat of grains {step}")
            if forces(a, step).keys() != forces(b, step).keys():
                found.append(f"contacts {step}")
    return found


def forces(file: h5py.File, step: str) -> dict:
    """Contacts of a frame: by the ids, the lower first, what acts between them [N]."""
    group = file[f"data/{step}/contacts"]
    force = np.column_stack([group[f"force/{axis}"][()] for axis in "xyz"])
    pairs = np.sort(np.column_stack([group["first"][()], group["second"][()]]), axis=1)
    return dict(zip(map(tuple, pairs), np.linalg.norm(force, axis=1)))


@needs_mpi
def test_two_ranks_tell_what_one_tells(every):
    """Energies, every account, the contacts of every class of lifetimes to the last one, what each
    grain has dissipated, and the contacts of the frames.
    """
    one, two = every
    assert same(one, two) == []
    with h5py.File(two) as file:
        weight = file["data/0/particles/cloud/mass"][0] * 9.81
        assert file.attrs["force_error"] < 1e-9 * weight
        last = file[f"data/{file.attrs['steps']}/particles/cloud"]
        heat, mobile = last["dissipated"][()], last["kind"][()] == 1
    energy = history(two)
    released = energy["potential"][0] - energy["potential"][-1]
    assert heat[mobile].sum() == pytest.approx(energy["dissipated"][-1], rel=1e-9)
    assert np.abs(energy["unaccounted"]).max() < 1e-3 * released


@needs_mpi
@pytest.mark.parametrize(
    "fault, shows", [(ranked.unhanded, "contacts"), (ranked.forceless, "unaccounted")]
)
def test_what_is_not_handed_over_shows(tmp_path, store, every, fault, shows):
    """Neither by a little: contacts that end at the border are another histogram, and a force that
    lacks is missed by the balance.
    """
    wrong = made(tmp_path / "wrong", store, 2, EVERY, fault)
    assert shows in same(every[0], wrong)
    with h5py.File(every[0]) as a, h5py.File(wrong) as b:
        if shows == "contacts":
            counts = [file["lifetime/contacts"][()] for file in (a, b)]
            assert np.abs(counts[0] - counts[1]).sum() > 10
        else:
            weight = a["data/0/particles/cloud/mass"][0] * 9.81
            assert b.attrs["force_error"] > 1e-2 * weight


@needs_mpi
def test_four_ranks_share_grains_of_many_sizes_that_resist_rolling(tmp_path, store):
    """Two by two, sampled; so thin are the slabs that a grain has neighbours on three ranks."""
    sets = ["time.maximum=0.25", *REAL]
    tables = packing.dict_of(load(CASE, sets))
    assert grid_of(tables, Grains.of(tables), 4) == Grid(2, 2)
    one, four = (made(tmp_path / f"{ranks}", store, ranks, sets) for ranks in (1, 4))
    assert same(one, four) == []
    assert history(four)["dissipated_rolling"][-1] > 0.0


def test_thin_slabs_are_cut_where_the_middle_grain_is_and_wide_ones_across():
    thin = packing.dict_of(load("cases/column_small"))
    wide = packing.dict_of(load("cases/column_small", ["geometry.thickness=0.072"]))
    chute = packing.dict_of(load("cases/chute_ci"))
    grids = [grid_of(case, Grains.of(case), 2) for case in (thin, wide)]
    assert grids == [Grid(2, 1), Grid(1, 2)]
    assert grid_of(wide, Grains.of(wide), 16) == Grid(2, 8)
    found = grid_of(chute, Grains.of(chute), 6)
    assert found.x * found.z == 6


@needs_mpi
def test_what_a_rank_finds_is_said_in_one_line(tmp_path):
    log = tmp_path / "log"
    assert run_on_ranks(ranked.counting, 5.0, ranks=3, log=log).result == 8.0
    with pytest.raises(CaseError, match="^x: one rank of all has found this$"):
        run_on_ranks(ranked.refusing, ranks=2, log=tmp_path / "log")
    with pytest.raises(Interrupted, match="^LIGGGHTS: stopped with code -9"):
        run_on_ranks(ranked.dying, ranks=2, log=tmp_path / "log")


@needs_mpi
def test_a_rank_without_grains_that_touch_is_refused(tmp_path, store):
    """As where the cut is left in the middle of the floor, far from the column."""
    with pytest.raises(CaseError, match="^--ranks 2: too many .* take fewer$"):
        made(tmp_path / "two", store, 2, SHORT, ranked.lopsided)


def test_what_lacks_for_ranks_is_named(tmp_path, store, capsys, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    words = ["--packings", str(store), "--set", SHORT[0], "--quiet", "--ranks", "2"]
    assert main([CASE, "-o", str(tmp_path / "dem.h5"), *words]) == 3
    said = capsys.readouterr().err
    assert said.startswith("mpi4py: no such module") and "python3-mpi4py" in said
    assert not list(tmp_path.iterdir())


def begun(place: Place) -> tuple[int, list[int]]:
    """The processes of mpirun and of its two ranks, once they are there."""
    until = time.monotonic() + 60.0
    while time.monotonic() < until:
        told = [line.split(" ", 1) for line in place.alive()]
        ranks = [int(pid) for pid, words in told if " dem_reference.ranks " in words]
        starters = [int(pid) for pid, words in told if words.startswith("mpirun ")]
        ranks = [pid for pid in ranks if pid not in starters]
        if len(ranks) == 2 and starters:
            return starters[0], ranks
        time.sleep(0.1)
    raise AssertionError(place.said.read_text())


@needs_mpi
@pytest.mark.parametrize("whom", ["run", "run, for good", "mpirun", "a rank"])
def test_nobody_outlives_whoever_is_killed(tmp_path, store, whom):
    words = ["dem_reference.run", CASE, "--ranks", 2, "--quiet", "-o"]
    place = Place(tmp_path / "p", store, words, "dem.h5")
    sets = ["time.maximum=1000.0", "time.rest_kinetic_energy=1e-9"]  # minutes to go
    place.command += [word for one in sets for word in ("--set", one)]
    one = place.start()
    starter, ranks = begun(place)
    hit = {"run": one.pid, "run, for good": one.pid, "mpirun": starter, "a rank": ranks[0]}[whom]
    os.kill(hit, signal.SIGTERM if whom == "run" else signal.SIGKILL)
    code, began = one.wait(timeout=PATIENCE), time.monotonic()
    while (alive := place.alive()) and time.monotonic() - began < PATIENCE:
        time.sleep(0.1)
    for line in alive:
        os.kill(int(line.split()[0]), signal.SIGKILL)
    assert not alive, alive
    assert code == {"run": 143, "run, for good": -9}.get(whom, 3)
    if code > 0:
        assert len(place.said.read_text().splitlines()) <= 1 and not place.left()


@needs_mpi
def test_the_engine_s_own_error_is_told(tmp_path):
    with pytest.raises(EngineError, match="^LIGGGHTS: stopped with code .*ERROR: Unknown command"):
        run_on_ranks(ranked.misspelling, tmp_path, ranks=2, log=tmp_path / "log")


@pytest.mark.parametrize("name, least", [("ranks", 1.6), ("ranks_wide", 1.6)])
def test_two_ranks_were_measured_to_be_faster(name, least):
    """With the same audit; and the model of two is right to a fifth."""
    table = pd.read_csv(f"cases/column_small/reference/{name}.csv", comment="#")
    faster = scaling.of(table, 1, "wall") / scaling.of(table, 2, "wall")
    assert faster > least
    grains = scaling.of(table, 1, "grains_most")
    one, two = (scaling.model(table, grains, n, scaling.Network()) for n in (1, 2))
    assert sum(one.values()) / sum(two.values()) == pytest.approx(faster, rel=0.2)


def test_the_model_of_more_ranks_is_that_of_the_page():
    table = pd.read_csv("cases/column_small/reference/ranks_wide.csv", comment="#")
    assert scaling.page(table) in Path("docs/reference/cluster.md").read_text()
    alone, many = (scaling.model(table, 1e6, n, scaling.Network()) for n in (1, 64))
    assert many["rows"] == alone["rows"] and many["frames"] == alone["frames"]
    assert many["own"] == pytest.approx(alone["own"] / 64)


@needs_mpi
def test_what_mpirun_says_is_told(tmp_path, monkeypatch):
    """On either stream, where it starts no rank."""
    for redirect in ("", ">&2"):
        (tmp_path / "mpirun").write_text(f"#!/bin/sh\necho no slots left {redirect}\nexit 1\n")
        (tmp_path / "mpirun").chmod(0o755)
        monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
        with pytest.raises(EngineError, match="stopped with code 1 .*no slots left"):
            run_on_ranks(shared.collapse, ranks=2, log=tmp_path / "log")


IN_A_WORLD = """
import subprocess, sys
from mpi4py import MPI  # which tells its children that they are in its world
sys.exit(subprocess.run([sys.executable, "-c", sys.argv[1]]).returncode)
"""
COUNTING = """
import importlib
from pathlib import Path
from dem_reference.ranks import run_on_ranks
ranked = importlib.import_module("tests.py.ranked")
assert run_on_ranks(ranked.counting, 5.0, ranks=3, log=Path({log!r})).result == 8.0
"""


@needs_mpi
def test_ranks_start_from_a_program_that_has_loaded_mpi(tmp_path):
    asked = COUNTING.format(log=str(tmp_path / "log"))
    done = subprocess.run(
        [sys.executable, "-c", IN_A_WORLD, asked], cwd=ROOT, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_settings_of_mpi_stay_outside_of_its_worlds(monkeypatch):
    monkeypatch.setenv("OMPI_MCA_orte_tmpdir_base", "/scratch")
    monkeypatch.delenv("PMIX_RANK", raising=False)
    assert outside_of_mpi()["OMPI_MCA_orte_tmpdir_base"] == "/scratch"
    monkeypatch.setenv("PMIX_RANK", "0")
    assert not {"OMPI_MCA_orte_tmpdir_base", "PMIX_RANK"} & set(outside_of_mpi())
