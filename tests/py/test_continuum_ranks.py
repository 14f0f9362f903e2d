"""`mpm_run --ranks`: processes under MPI give one process's result, and one line where they cannot.
What ranks do to a column is tested where they are threads (tests/cpp/ranks_test.cpp).
"""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from importlib.util import find_spec

import h5py
import numpy as np
import pytest

from cases.programs import ROOT, program
from bits import differences
from watched import seen

CI = ROOT / "cases" / "column_ci"
OFTEN = "output.checkpoint_interval=0.02"  # [s]
SETS = ("mpm.precision=double", "mpm.cell_size=0.001", "time.maximum=0.5")

pytestmark = pytest.mark.skipif(
    not program("mpm_run_ranks").exists() or not shutil.which("mpirun"),
    reason="no mpm_run_ranks (built without MPI: libopenmpi-dev, packages-cluster.txt)",
)


def command(out, *words, sets=SETS, case=CI):
    line = [program("mpm_run"), case, "-o", out, "--quiet", *words]
    return [str(word) for word in line + [word for one in sets for word in ("--set", one)]]


def run(out, *words, sets=SETS, case=CI):
    return subprocess.run(
        command(out, *words, sets=sets, case=case),
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """Results of one process and of two."""
    folder = tmp_path_factory.mktemp("both")
    for name, ranks in (("one", 1), ("two", 2)):
        done = run(folder / f"{name}.h5", "--ranks", ranks)
        assert (done.returncode, done.stderr) == (0, "")
    assert {path.name for path in folder.iterdir()} == {"one.h5", "two.h5"}
    with h5py.File(folder / "one.h5") as one, h5py.File(folder / "two.h5") as two:
        yield one, two


def test_two_processes_have_the_points_of_one(both):
    """To round-off: sums at nodes that both share are taken in another order."""
    one, two = both
    assert list(one["data"]) == list(two["data"])
    for step in one["data"]:
        ours, theirs = (file[f"data/{step}/particles/cloud"] for file in both)
        assert np.array_equal(ours["id"], theirs["id"])  # a row each, as ever
        for name in ("mass", "regime"):
            assert np.array_equal(ours[name], theirs[name])
        for place, scale in (("position/x", 0.02), ("velocity/y", 0.5), ("stress/yy", 300.0)):
            np.testing.assert_allclose(theirs[place], ours[place], rtol=0, atol=1e-9 * scale)


def test_their_history_is_that_of_the_whole(both):
    one, two = both
    held = sum(one[f"energy/{name}"][0] for name in ("kinetic", "potential", "elastic"))
    for name, values in one["energy"].items():
        bound = 1e-9 * (held if values.attrs["unit"] == "J" else 1.0)
        np.testing.assert_allclose(two[f"energy/{name}"], values, rtol=1e-9, atol=bound)
    for name in ("end_reason", "steps", "warnings", "case_resolved", "seed"):
        assert one.attrs[name] == two.attrs[name]
    assert (one.attrs["threads"], two.attrs["threads"]) == (1, 2)


def test_two_processes_share_a_chute(tmp_path):
    """Each is the other's neighbour on both sides: sums must not come to the wrong border. The
    surface passes some three periods.
    """
    sets = ["mpm.precision=double", "mpm.cell_size=0.00075", "mpm.jitter=0.3", "time.maximum=1"]
    sets.append("initial.velocity=0.5")
    for ranks in (1, 2):
        out = tmp_path / f"{ranks}.h5"
        done = run(out, "--ranks", ranks, sets=sets, case=ROOT / "cases" / "chute_ci")
        assert (done.returncode, done.stderr) == (0, "")
    with h5py.File(tmp_path / "1.h5") as one, h5py.File(tmp_path / "2.h5") as two:
        last = max(one["data"], key=int)
        for place, scale in (("velocity/x", 1.0), ("velocity/y", 1.0), ("stress/yy", 100.0)):
            ours, theirs = (file[f"data/{last}/particles/cloud/{place}"] for file in (one, two))
            np.testing.assert_allclose(theirs, ours, rtol=0, atol=1e-9 * scale)
        driven, theirs = one["energy/driven"], two["energy/driven"]
        np.testing.assert_allclose(theirs, driven, rtol=0, atol=1e-9 * driven[-1])


@pytest.mark.parametrize(
    "sets, case, ranks, code, said",
    [
        ([], CI, 3, 2, "--ranks 3: the column is 10 cells long (a rank takes 8 at least)"),
        (["grains.density=-1"], CI, 2, 2, "grains.density = -1"),
        (
            ["mpm.time_step_fraction=5", "mpm.velocity_relaxation=1e9", "mpm.cell_size=0.0005"]
            + [OFTEN],
            CI,
            2,
            3,
            "[energy-growth]",
        ),
    ],
    ids=["too many", "a bad value", "an instability"],
)
def test_what_cannot_be_is_one_line(tmp_path, sets, case, ranks, code, said):
    if ranks == 3:
        sets = ["mpm.cell_size=0.002"]
    done = run(tmp_path / "o.h5", "--ranks", ranks, sets=sets, case=case)
    assert done.returncode == code and said in done.stderr and done.stderr.count("\n") == 1, done
    assert not list(tmp_path.iterdir())


def test_a_place_that_cannot_be_written_is_one_line(tmp_path):
    done = run(tmp_path / "no" / "o.h5", "--ranks", 2)
    assert done.returncode == 2 and "cannot be written" in done.stderr
    assert done.stderr.count("\n") == 1


def ranks_of(mark: str) -> list[int]:
    """Processes that run as ranks with these words on their command lines."""
    told = subprocess.run(["ps", "-eo", "pid,stat,args"], capture_output=True, text=True)
    rows = [row for row in told.stdout.splitlines() if mark in row and "mpm_run_ranks" in row]
    ours = [row.split()[:2] for row in rows if " mpirun " not in row]
    return [int(pid) for pid, state in ours if state[0] != "Z"]


def kill(number: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(number, signal.SIGKILL)


def wait_until(ready, seconds: float) -> None:
    began = time.monotonic()
    while not ready():
        assert time.monotonic() - began < seconds
        time.sleep(0.02)


def test_who_is_killed_leaves_no_rank_behind(tmp_path):
    mark = f"title={tmp_path.name}"
    line = command(tmp_path / "o.h5", "--ranks", 2, sets=("mpm.cell_size=0.0004", mark))
    one = subprocess.Popen(line, stderr=subprocess.DEVNULL)
    wait_until(lambda: one.poll() is not None or len(ranks_of(mark)) == 2, 60.0)
    one.send_signal(signal.SIGKILL)
    one.wait()
    wait_until(lambda: not ranks_of(mark), 90.0)


KEPT = ("time.maximum=1.2", "mpm.cell_size=0.001")


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    result = tmp_path_factory.mktemp("undisturbed") / "mpm.h5"
    assert run(result, "--ranks", 2, sets=(*KEPT, "output.checkpoint_interval=0")).returncode == 0
    return result


def parts(result, rank: int) -> list:
    """A rank's of all checkpoints, the newest last."""
    found = seen(result.with_name(f"{result.name}.unfinished"), "checkpoint-*")
    ours = [path for path in found if path.suffix == (f".{rank}" if rank else "")]
    return sorted(ours, key=lambda path: int(path.stem.split("-")[1]))


@pytest.fixture
def killed(tmp_path):
    """Ranks that were killed with two checkpoints that both have; on a busy machine they may be
    ready before that is seen, and then others are killed.
    """
    result = tmp_path / "mpm.h5"
    for _ in range(10):
        line = command(result, "--ranks", 2, sets=(*KEPT, OFTEN))
        one = subprocess.Popen(line, stderr=subprocess.DEVNULL)
        kept: set[str] = set()
        while one.poll() is None and len(kept) < 3:
            kept |= {path.name for path in parts(result, 1)}
        for number in (one.pid, *ranks_of(str(result))):  # ranks alone live on for a second
            kill(number)
        one.wait()
        wait_until(lambda: not ranks_of(str(result)), 90.0)
        if one.returncode == -signal.SIGKILL and not result.exists():
            return result
        result.unlink(missing_ok=True)
    raise AssertionError("every run was ready before it was killed")


def began_at(said: str) -> float:
    assert said.count("\n") == 1 and "goes on from t = " in said
    return float(said.split("t = ")[1].split()[0])


def test_killed_ranks_end_with_the_same_bits(killed, undisturbed):
    """From whichever checkpoint: the newest; the one before, where a rank lacks its part."""
    times = []
    folder = killed.with_name(f"{killed.name}.unfinished")
    copies = killed.with_name("copies")
    shutil.copytree(folder, copies)
    for lacks in (None, parts(killed, 1)[-1].name):
        if lacks:
            shutil.move(copies, folder)
            (folder / lacks).unlink()
        done = run(killed, "--ranks", 2, sets=(*KEPT, OFTEN))
        assert done.returncode == 0
        times.append(began_at(done.stderr))
        assert differences(undisturbed, killed) == ["@case_resolved"]  # which tells the interval
        assert not folder.exists()
    assert 0.0 < times[1] < times[0]


@pytest.mark.parametrize("ranks, sets", [(1, ()), (2, ("grains.density=2532.000000001",))])
def test_what_others_have_kept_is_not_gone_on_from(killed, undisturbed, ranks, sets):
    """The control, too: what differs in the twelfth digit would be seen."""
    done = run(killed, "--ranks", ranks, sets=(*KEPT, OFTEN, *sets))
    assert "begins anew: what was kept there is of another run" in done.stderr
    assert len(differences(undisturbed, killed)) > 50
    assert {path.name for path in killed.parent.iterdir()} == {killed.name}


IN_A_WORLD = """
import subprocess, sys
from mpi4py import MPI  # which tells its children that they are in its world
sys.exit(subprocess.run(sys.argv[1:]).returncode)
"""


@pytest.mark.skipif(not find_spec("mpi4py"), reason="python3-mpi4py is not installed")
def test_ranks_start_from_a_program_that_has_loaded_mpi(tmp_path):
    words = command(tmp_path / "mpm.h5", "--ranks", "2", sets=("time.maximum=0.05",))
    done = subprocess.run(
        [sys.executable, "-c", IN_A_WORLD, *words], capture_output=True, text=True, timeout=100
    )
    assert (done.returncode, done.stderr) == (0, "")
