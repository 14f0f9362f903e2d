"""A grain engine that is missing, broken or killed: one line, exit code 3, nothing left behind."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cases.programs import ROOT

RUN = [
    sys.executable,
    "-m",
    "compare",
    "run",
    str(ROOT / "cases" / "column_ci"),
    "--quiet",
    "--set",
    "mpm.cell_size=0.0005",  # the continuum is at work for longer than grains need to begin
    "--out",
    "result",
]


def start(folder: Path, **environment) -> subprocess.Popen:
    # A shell's background jobs ignore SIGINT, and so would what they start.
    return subprocess.Popen(
        RUN,
        cwd=folder,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        env=os.environ | {"PYTHONPATH": str(ROOT)} | environment,
    )


def failed_cleanly(run: subprocess.Popen, folder: Path) -> str:
    """The one line of a run that failed as an engine's failure should."""
    out, err = run.communicate(timeout=120)
    assert run.returncode == 3, err
    assert out == "" and err.count("\n") == 1, err
    assert not list(folder.rglob("*.h5")) and not (folder / "result").exists()
    assert not [path for path in folder.iterdir() if path.name.startswith(".result")]
    return err


def engines_of(pid: int) -> list[int]:
    """Descendants of a process that have LIGGGHTS loaded."""
    children: dict[int, list[int]] = {}
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(status.read_text().rsplit(")", 1)[1].split()[1])
        except OSError:
            continue  # it ended meanwhile
        children.setdefault(parent, []).append(int(status.parent.name))
    found, waiting = [], [pid]
    while waiting:
        one = waiting.pop()
        waiting += children.get(one, [])
        try:
            if "libliggghts" in Path(f"/proc/{one}/maps").read_text():
                found.append(one)
        except OSError:
            continue
    return found


def wait_for_engines(run: subprocess.Popen) -> list[int]:
    deadline = time.monotonic() + 60
    while not (engines := engines_of(run.pid)):
        assert run.poll() is None and time.monotonic() < deadline
        time.sleep(0.05)
    return engines


def at_work(pid: int) -> bool:
    """Whether a process is there and no zombie that waits for init."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def test_a_library_that_does_not_load_is_named_with_its_package(tmp_path):
    broken = tmp_path / "libraries"
    broken.mkdir()
    (broken / "libliggghts.so.3").touch()
    line = failed_cleanly(start(tmp_path, LD_LIBRARY_PATH=str(broken)), tmp_path)
    assert line.startswith("LIGGGHTS: libliggghts.so.3 cannot be loaded")
    assert "install the packages liggghts" in line


@pytest.mark.parametrize("ending", [signal.SIGSEGV, signal.SIGKILL])
def test_an_engine_that_dies_is_reported_with_its_last_words(tmp_path, ending):
    run = start(tmp_path)
    os.kill(wait_for_engines(run)[0], ending)
    line = failed_cleanly(run, tmp_path)
    assert line.startswith(f"LIGGGHTS: stopped with code -{ending.value} (")


@pytest.mark.parametrize(
    "ending, code, words",
    [(signal.SIGINT, 130, "grainpair: interrupted\n"), (signal.SIGTERM, 143, "")],
)
def test_an_interrupted_run_ends_its_engines_and_leaves_nothing(tmp_path, ending, code, words):
    run = start(tmp_path)
    engines = wait_for_engines(run)
    run.send_signal(ending)
    out, err = run.communicate(timeout=60)
    assert (run.returncode, out, err) == (code, "", words)
    assert not list(tmp_path.iterdir())
    assert not any(at_work(pid) for pid in engines)
