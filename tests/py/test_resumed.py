"""A continuum run that is killed goes on from its last checkpoint, and ends with the bits of one
that nobody killed.
"""

import random
import resource
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest

from cases.programs import ROOT, program
from bits import differences
from watched import seen

CI = ROOT / "cases" / "column_ci"
OFTEN = "output.checkpoint_interval=0.02"
SCENES = {
    "the full model": (),
    "two threads": ("--threads", 2),
    "conduction": ("material.conduction=true",),
    "a cone, single precision": ("material.law=drucker_prager", "mpm.precision=single"),
    "a library": (ROOT / "cases" / "laws" / "mohr_coulomb", "time.maximum=0.4"),
    "no averages, stress first": (
        "mpm.volumetric_averaging=none",
        "mpm.stress_update=first",
        "mpm.transfer=apic",
    ),
    "sharpened": ("mpm.transfer=xpic", "mpm.shape=gimp", "mpm.jitter=0.2"),
    "space": ("geometry.dimension=three_dimensional", "mpm.cell_size=0.002", "time.maximum=0.8"),
    "a cylinder": (ROOT / "cases" / "cylinder", "mpm.cell_size=0.002", "time.maximum=0.8"),
    "volumes that follow the room": ("mpm.volume_relaxation=1", "mpm.jitter=0.2"),
    "a lifted gate": ("walls.gate=lifted", "walls.gate_speed=0.5"),
}


def command(result: Path, *more) -> list[str]:
    """`more`: assignments, other words, and the case where it is not the usual one."""
    cases = [word for word in more if isinstance(word, Path)] or [CI]
    words = [program("mpm_run"), *cases, "-o", result, "--seed", 3, "--quiet"]
    sets = ("time.maximum=1.2", "mpm.cell_size=0.0016", "output.checkpoint_interval=0", *more)
    for one in sets:
        if not isinstance(one, Path):
            words += ["--set", one] if "=" in str(one) else [one]
    return [str(word) for word in words]


def finish(result: Path, *more) -> str:
    """Runs to the end; what was said."""
    done = subprocess.run(command(result, *more), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stderr


def kill_at_checkpoint(result: Path, number: int, *more) -> None:
    """Kills a run as soon as it has kept itself `number` times; on a busy machine it may be ready
    before that is seen, and then another is killed.
    """
    for _ in range(40):
        with subprocess.Popen(command(result, *more, OFTEN), stderr=subprocess.DEVNULL) as one:
            kept: set[str] = set()
            while one.poll() is None and len(kept) < number:
                kept |= {path.name for path in seen(unfinished(result), "checkpoint-*")}
            one.kill()
        if one.returncode == -signal.SIGKILL and checkpoints(result):
            return
        result.unlink(missing_ok=True)
    raise AssertionError("every run was ready before it was killed")


def unfinished(result: Path) -> Path:
    return result.with_name(f"{result.name}.unfinished")


def folder(result: Path) -> list[str]:
    return sorted(path.name for path in result.parent.iterdir())


@pytest.mark.parametrize("scene", SCENES)
def test_a_killed_run_ends_with_the_same_bits(tmp_path, scene):
    undisturbed, killed = tmp_path / "undisturbed.h5", tmp_path / "killed.h5"
    finish(undisturbed, *SCENES[scene])
    for number in (1, 2):
        kill_at_checkpoint(killed, number, *SCENES[scene])
    assert any(unfinished(killed).glob("checkpoint-*"))
    assert "goes on from t = " in finish(killed, *SCENES[scene], OFTEN)
    assert differences(undisturbed, killed) == ["@case_resolved"]  # which tells the interval
    assert folder(killed) == ["killed.h5", "undisturbed.h5"]


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    result = tmp_path_factory.mktemp("undisturbed") / "mpm.h5"
    finish(result)
    return result


@pytest.fixture
def kept(tmp_path):
    """A run that was killed with two checkpoints, or with three: the oldest goes when the newest
    is there.
    """
    result = tmp_path / "mpm.h5"
    kill_at_checkpoint(result, 3)
    assert len(checkpoints(result)) in (2, 3)
    return result


def checkpoints(result: Path) -> list[Path]:
    """The newest last."""
    found = unfinished(result).glob("checkpoint-*")
    return sorted(found, key=lambda path: int(path.name.split("-")[1]))


def test_any_signal_at_any_moment(tmp_path, undisturbed):
    result, moments = tmp_path / "mpm.h5", random.Random(1)
    for number in (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGKILL):
        with subprocess.Popen(command(result, OFTEN), stderr=subprocess.DEVNULL) as one:
            time.sleep(0.3 * moments.random())
            one.send_signal(number)
    finish(result, OFTEN)
    assert differences(undisturbed, result) == ["@case_resolved"]
    assert folder(result) == ["mpm.h5"]


@pytest.mark.parametrize("spoilt", ["cut short", "a bit changed", "its frames gone"])
def test_a_spoilt_checkpoint_gives_way_to_the_one_before(kept, undisturbed, spoilt):
    newest = checkpoints(kept)[-1]
    whole = newest.read_bytes()
    if spoilt == "cut short":
        newest.write_bytes(whole[:-1000])
    elif spoilt == "a bit changed":
        place = len(whole) // 2
        newest.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
    else:
        frames = unfinished(kept).glob("frames-*.h5")
        max(frames, key=lambda path: int(path.stem.split("-")[1])).unlink()
        # the one before may count the same frames, and then nothing is left to go on from
    finish(kept, OFTEN)
    assert differences(undisturbed, kept) == ["@case_resolved"]


def test_the_older_one_is_gone_on_from(kept):
    """What is said tells which: of the two, the time of the older."""
    copies = kept.with_name("copies")
    shutil.copytree(unfinished(kept), copies)
    said = [finish(kept, OFTEN)]
    shutil.move(copies, unfinished(kept))
    checkpoints(kept)[-1].write_bytes(b"nothing of worth")
    said.append(finish(kept, OFTEN))
    newer, older = (float(line.split("t = ")[1].split()[0]) for line in said)
    assert 0.0 < older < newer


def test_where_all_are_spoilt_the_run_begins_anew(kept, undisturbed):
    for path in checkpoints(kept):
        path.write_bytes(b"nothing of worth")
    assert finish(kept, OFTEN) == ""
    assert differences(undisturbed, kept) == ["@case_resolved"]


@pytest.mark.parametrize("other", ["mpm.jitter=0.1", "grains.friction=0.6"])
def test_another_run_does_not_go_on_from_it(kept, other):
    said = finish(kept, other, OFTEN)
    assert "begins anew: what was kept there is of another run" in said


def test_a_change_in_the_twelfth_digit_would_be_seen(tmp_path, undisturbed):
    result = tmp_path / "mpm.h5"
    finish(result, "grains.density=2532.000000001")
    assert len(differences(undisturbed, result)) > 50


def test_a_run_that_fails_by_itself_leaves_nothing(tmp_path):
    result = tmp_path / "mpm.h5"
    words = ("mpm.time_step_fraction=5", "mpm.velocity_relaxation=1e9", "time.maximum=6", OFTEN)
    done = subprocess.run(command(result, *words), capture_output=True, text=True)
    assert done.returncode == 3 and done.stderr.strip().endswith("]")
    assert folder(result) == []


def test_without_room_for_checkpoints_the_run_goes_on(tmp_path):
    """A checkpoint is larger here than the result, which has two frames."""
    undisturbed, result = tmp_path / "undisturbed.h5", tmp_path / "mpm.h5"
    finish(undisturbed, "time.frame_interval=100")
    size = 2 * undisturbed.stat().st_size
    words = command(result, "time.frame_interval=100", OFTEN)
    done = subprocess.run(
        words,
        capture_output=True,
        text=True,
        restore_signals=False,  # a file too large is an error, not a signal
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size)),
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("cannot be kept half-way: the run goes on without") == 1
    assert differences(undisturbed, result) == ["@case_resolved"]
    assert folder(result) == ["mpm.h5", "undisturbed.h5"]
