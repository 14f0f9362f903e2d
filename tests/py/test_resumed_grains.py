"""Runs of the grains that are killed and go on: every bit is that of the run that was let be."""

import errno
import os
import random
import shutil
import signal
import subprocess
import time
from functools import cache
from pathlib import Path

import h5py
import numpy as np
import pytest

import watched
from bits import bits
from cases.errors import EngineError
from cases.h5_output import H5Output
from cases.programs import ROOT, module
from dem_reference.checkpoint import PART, Keeper, Unfinished
from dem_reference.process import Interrupted, Voice

OFTEN = "output.checkpoint_interval=0.01"  # so wherever one can be: every thousand steps
SHORT = "time.maximum=2.5"  # some five thousand steps
SCENES: dict[str, list[str]] = {
    "instantaneous": [],
    "lifted": [
        'walls.gate="lifted"',
        "walls.gate_speed=0.3",  # gone after half of them
        'walls.left="coulomb"',  # with springs of its own
        "walls.left_friction=0.5",
        "grains.size_spread=0.2",
        "grains.rolling_friction=0.1",
    ],
}
PATIENCE = 60.0  # [s]


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return tmp_path_factory.mktemp("packings")


def command(path: Path, store: Path, *sets: str) -> list:
    words = [word for one in sets for word in ("--set", one)]
    words += ["-o", called(path), "--packings", str(store)]
    return module("dem_reference.run", "cases/column_ci", *words)


def called(path: Path) -> str:
    """A result as a user who works in ROOT may call it; the engine works elsewhere."""
    return os.path.relpath(path, ROOT)


def complete(path: Path, store: Path, *sets: str) -> str:
    """Runs to the end; what it says on standard error."""
    done = subprocess.run(
        [*command(path, store, *sets), "--quiet"],
        cwd=ROOT,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stderr


def killed(path: Path, store: Path, number: int, more: int, later: float, *sets: str) -> bool:
    """Starts a run and kills it by signal `number`, `later` [s] after it has kept `more`
    checkpoints; whether it was killed, not done.
    """
    begun = time.monotonic()
    process = subprocess.Popen(
        [*command(path, store, *sets), "--quiet"],
        cwd=ROOT,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    seen = set(checkpoints(path))
    while process.poll() is None and more > 0:
        found = set(checkpoints(path))
        more -= len(found - seen)
        seen |= found
        assert time.monotonic() - begun < PATIENCE
        time.sleep(0.005)
    time.sleep(later)
    process.send_signal(number)
    return process.wait(PATIENCE) != 0


def folder(path: Path) -> Path:
    return path.with_name(f"{path.name}.unfinished")


def checkpoints(path: Path) -> list[Path]:
    """From the oldest to the newest."""
    return sorted(watched.seen(folder(path), "checkpoint-*.h5"), key=lambda one: int(one.stem[11:]))


def contents(path: Path) -> dict[str, bytes]:
    """Of a result, bit by bit, without the case: that tells how often it was kept."""
    return {
        place: one for place, one in bits(path).items() if place not in ("@case", "@case_resolved")
    }


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory, store):
    """All that is in the result of a scene, by its name."""

    @cache
    def of(scene: str) -> dict:
        path = tmp_path_factory.mktemp("undisturbed") / "dem.h5"
        sets = [SHORT, *SCENES[scene], "output.checkpoint_interval=0"]
        assert complete(path, store, *sets) == ""
        assert [one.name for one in path.parent.iterdir()] == ["dem.h5"]
        return contents(path)

    return of


@pytest.mark.parametrize("gate", ["instantaneous", "lifted"])
def test_a_run_killed_again_and_again_ends_with_the_same_bits(undisturbed, store, tmp_path, gate):
    """At any moment of the start, then soon after each of three checkpoints."""
    chance, path = random.Random(len(gate)), tmp_path / "dem.h5"
    sets = [SHORT, *SCENES[gate], OFTEN]
    assert killed(path, store, signal.SIGKILL, 0, chance.uniform(0, 1), *sets)
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGKILL):
        assert killed(path, store, number, 1, chance.uniform(0, 0.1), *sets)
    said = complete(path, store, *sets)
    assert said.startswith(f"{called(path)}: goes on from t = ") and said.count("\n") == 1
    assert contents(path) == undisturbed(gate)
    assert [one.name for one in tmp_path.iterdir()] == ["dem.h5"]


def state_of(path: Path) -> dict:
    """All that a checkpoint holds, without what tells of when and at what cost."""
    with h5py.File(path) as file:
        return {
            name: values[()].tobytes()
            for name, values in file.items()
            if name not in ("date", "spent", "taken")
        }


def test_a_box_that_has_grown_goes_on_as_it_would(store, tmp_path):
    """Grains roll off the end of the floor. Read from a restart, the box would be the least that
    LIGGGHTS lets it shrink to, and a few micrometres larger: the next checkpoint, which holds the
    box, shows that.
    """
    path, sets = tmp_path / "dem.h5", [SHORT, "geometry.floor_length=0.025", OFTEN]
    assert killed(path, store, signal.SIGKILL, 4, 0.0, *sets)
    older, newest = checkpoints(path)[-2:]
    expected = state_of(newest)
    with h5py.File(older) as file:
        step, bounds = int(file["step"][()]), file["bounds"][()]
    newest.unlink()
    assert killed(path, store, signal.SIGKILL, 1, 0.0, *sets)
    assert state_of(newest) == expected
    reached = []
    for segment in folder(path).glob("frames-*.h5"):
        with h5py.File(segment) as file:
            for frame in (number for number in file["data"] if int(number) < step):
                reached.append(file[f"data/{frame}/particles/cloud/position/x"][()].max())
    assert max(reached) > bounds[1]


@pytest.fixture(scope="module")
def stopped(tmp_path_factory, store):
    """A result that is not complete, with two checkpoints, and what it ought to become."""
    path = tmp_path_factory.mktemp("stopped") / "dem.h5"
    assert killed(path, store, signal.SIGKILL, 2, 0.0, SHORT, OFTEN)
    assert len(checkpoints(path)) == 2
    return path


@pytest.fixture
def copied(stopped, tmp_path):
    """Another name of the same, to be spoilt."""
    path = tmp_path / stopped.name
    shutil.copytree(folder(stopped), folder(path))
    return path


@pytest.fixture
def plain(undisturbed):
    return undisturbed("instantaneous")


def without_springs(restart: np.ndarray) -> np.ndarray:
    """A restart in which LIGGGHTS does not find the springs of contacts: by another name."""
    told = restart.tobytes()
    assert b"contacthistory" in told
    return np.frombuffer(told.replace(b"contacthistory", b"contacthistorx"), np.uint8)


def without_totals(accounts: np.ndarray) -> np.ndarray:
    """A state of the accounts that has forgotten its first values, the totals."""
    return np.concatenate([np.zeros(32, np.uint8), accounts[32:]])


@pytest.mark.parametrize(
    "name, spoilt, differs",
    [
        ("restart", lambda kept: kept, ()),
        ("restart", without_springs, ("position", "energy/elastic_tangential")),
        ("accounts", without_totals, ("energy/dissipated_normal",)),
        ("force", np.zeros_like, ("position",)),
    ],
)
def test_whatever_a_checkpoint_lacks_shows(copied, store, plain, name, spoilt, differs):
    """Controls: the comparison sees each part of the state that was dropped."""
    with h5py.File(checkpoints(copied)[-1], "a") as file:
        kept = file[name][()]
        del file[name]
        file[name] = spoilt(kept)
    complete(copied, store, SHORT, OFTEN)
    found = contents(copied)
    assert found.keys() == plain.keys()
    unlike = [one for one in plain if found[one] != plain[one]]
    assert bool(unlike) == bool(differs)
    assert all(any(part in one for one in unlike) for part in differs)


def test_of_a_broken_checkpoint_the_one_before_is_taken(copied, store, plain):
    older, newest = checkpoints(copied)
    with newest.open("r+b") as file:
        file.truncate(newest.stat().st_size // 2)
    with h5py.File(older) as file:
        told = f"goes on from t = {file['time'][()]:.4g} s"
    assert told in complete(copied, store, SHORT, OFTEN)
    assert contents(copied) == plain


def test_a_changed_byte_of_a_checkpoint_is_seen(copied):
    """What HDF5 does not look at when it opens a file."""
    newest = checkpoints(copied)[-1]
    with h5py.File(newest) as file:
        key, place = file.attrs["key"], file["restart"].id.get_chunk_info(0).byte_offset
    unfinished = Unfinished.of(copied, key)
    assert unfinished.read(newest) is not None
    data = bytearray(newest.read_bytes())
    data[place + 100] ^= 1
    newest.write_bytes(data)
    assert unfinished.read(newest) is None


def test_a_checkpoint_of_another_run_is_left_aside(copied, store, tmp_path):
    assert complete(copied, store, "time.maximum=0.5", OFTEN) == ""
    assert [one.name for one in tmp_path.iterdir()] == ["dem.h5"]
    with h5py.File(copied) as file:
        assert file["energy/time"][-1] < 0.6 * file.attrs["time_scale"]


def test_what_no_checkpoint_counts_is_removed(copied):
    """And nothing that somebody else has put there."""
    newest = checkpoints(copied)[-1]
    with h5py.File(newest) as file:
        key, count = file.attrs["key"], int(file["segments"][()])
    there = Unfinished.of(copied, key)
    for name in (f"frames-{count + 1}.h5", PART, "notes.txt"):
        (folder(copied) / name).touch()
    state = there.newest()
    assert state is not None and int(state["segments"]) == count
    frames = [f"frames-{number + 1}.h5" for number in range(count)]
    kept = [one.name for one in checkpoints(copied)]
    assert {one.name for one in folder(copied).iterdir()} == {*frames, *kept, "notes.txt"}
    there.remove()
    assert [one.name for one in folder(copied).iterdir()] == ["notes.txt"]


@pytest.mark.parametrize("error, stays", [(EngineError, False), (Interrupted, True)])
def test_a_run_that_fails_by_itself_leaves_nothing(copied, error, stays):
    with h5py.File(checkpoints(copied)[-1]) as file:
        unfinished = Unfinished.of(copied, file.attrs["key"])
    with pytest.raises(error), unfinished.until_done():
        raise error("LIGGGHTS: stopped")
    assert folder(copied).exists() == stays


class Said(Voice):
    """Keeps what a keeper warns of."""

    def __init__(self):
        self.lines: list[str] = []

    def warn(self, line: str) -> None:
        self.lines.append(line)


def test_without_room_for_checkpoints_a_run_goes_on(tmp_path, monkeypatch):
    """It says so once; what is there stays."""
    said = Said()
    keeper = Keeper(Unfinished.of(tmp_path / "dem.h5", "key", 1.0), 0, said)
    keeper.keep(1000, {"sampled": np.arange(4)})

    def fail(self):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(H5Output, "tell", fail)
    for step in (2000, 3000):
        keeper.keep(step, {"sampled": np.arange(4)})
    assert len(said.lines) == 1
    assert "dem.h5: no checkpoint (No space left on device)" in said.lines[0]
    names = [one.name for one in (tmp_path / "dem.h5.unfinished").iterdir()]
    assert names == ["checkpoint-1000.h5"]


def test_a_packing_goes_on_with_the_attempts_it_has(tmp_path):
    """Killed in its second attempt, a search does not make the first again, and ends alike."""
    small = ["geometry.length=0.012", "geometry.height=0.012", "time.maximum=0.1"]
    sets = [*small, "dem.void_ratio_tolerance=1e-4", "dem.packing_attempts=2"]
    alone, store = tmp_path / "alone", tmp_path / "store"
    complete(tmp_path / "alone.h5", alone, *sets)
    process = subprocess.Popen(
        [*command(tmp_path / "dem.h5", store, *sets), "--quiet"], cwd=ROOT, start_new_session=True
    )
    while not watched.seen(store, "*.unfinished/0"):
        assert process.poll() is None
        time.sleep(0.005)
    process.kill()
    process.wait(PATIENCE)
    first = next(store.glob("*.unfinished/0/packing.restart"))
    made = first.stat().st_mtime_ns
    complete(tmp_path / "dem.h5", store, *sets)
    assert contents(tmp_path / "dem.h5") == contents(tmp_path / "alone.h5")
    (kept,) = store.iterdir()
    assert "unfinished" not in kept.name
    with h5py.File(kept / "packing.h5") as file:
        tried = file["attempts"][()]
    assert len(tried) == 2
    if abs(tried[0, 2] - 0.71) < abs(tried[1, 2] - 0.71):  # the first is the one kept
        assert (kept / "packing.restart").stat().st_mtime_ns == made
