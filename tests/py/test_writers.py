"""Commands check before they write, replace nothing that is not theirs, and leave a folder as it
was where they fail.
"""

import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import pytest
from foreign_block import SCENE, SIZES, write
from synthetic import write_pair, write_run

from cases import files
from cases.errors import CaseError, EngineError
from cases.programs import ROOT, program
from compare import __main__ as cli
from compare.verdict.conclusion import INVALID
from compare.commands import accuracy, calibrate, dimension
from dem_reference import process, splits

DONE = (0, INVALID)  # what a comparison of any grains ends with
COLUMN = str(ROOT / "cases" / "column_ci")


def contents(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else b""
        for path in folder.rglob("*")
    }


@pytest.fixture
def dumped(tmp_path, monkeypatch):
    """A folder with a run of either engine, a dump, and what compares the two."""
    monkeypatch.setattr("compare.commands.compare.case.load", lambda _: SCENE)
    few = SIZES | {"frames": 2}
    folder = write_pair(tmp_path / "run", mpm=few, dem=few)
    dump = write(tmp_path / "a.dump")
    return folder, ["--dump", str(dump), "--case", "scene.toml", "--time-step", "1e-5", "--quiet"]


def test_grains_that_were_run_are_not_lost_to_a_dump(dumped, capsys):
    folder, words = dumped
    before = contents(folder)
    assert cli.main(["compare", str(folder), *words]) == 2
    line = capsys.readouterr().err
    assert line.startswith(f"{folder}/dem.h5: is there, and not imported")
    assert "--replace" in line and line.count("\n") == 1
    assert contents(folder) == before


def test_told_to_replace_them_it_does_and_then_need_not_be_told(dumped):
    folder, words = dumped
    assert cli.main(["compare", str(folder), *words, "--replace"]) in DONE
    with h5py.File(folder / "dem.h5") as file:
        assert "source" in file.attrs
    assert (folder / "report.html").exists()
    assert cli.main(["compare", str(folder), *words]) in DONE


@pytest.mark.parametrize("spoilt", ["dump", "scene", "continuum", "option"])
def test_a_dump_that_cannot_be_compared_leaves_the_folder_as_it_was(dumped, spoilt, capsys):
    folder, words = dumped
    (folder / "dem.h5").unlink()
    if spoilt == "dump":
        Path(words[1]).write_text("no dump")
    elif spoilt == "scene":
        write_run(folder / "mpm.h5", "mpm", frames=2, height=0.05)
    elif spoilt == "continuum":
        (folder / "mpm.h5").unlink()
    else:
        words = [*words, "--table", str(folder / "mpm.h5")]
    before = contents(folder)
    assert cli.main(["compare", str(folder), *words]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert contents(folder) == before


def test_a_comparison_stopped_in_its_figures_leaves_the_earlier_report(tmp_path, monkeypatch):
    folder = write_pair(tmp_path / "run", mpm={"frames": 2}, dem={"frames": 2})
    (folder / "report.html").write_text("old")
    before = contents(tmp_path)

    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("compare.report.report.draw", stop)
    assert cli.main(["compare", str(folder), "--quiet"]) == 130
    assert contents(tmp_path) == before


def test_an_export_is_of_every_file_or_of_none(tmp_path, capsys):
    folder = write_pair(tmp_path / "run", mpm={"frames": 2}, dem={"frames": 2})
    assert cli.main(["export", str(folder)]) == 0
    assert (folder / "vtk" / "mpm.pvd").exists() and (folder / "vtk" / "dem.pvd").exists()
    (folder / "vtk" / "notes").write_text("mine")
    write_run(folder / "dem.h5", "dem", frames=3)
    (folder / "mpm.h5").write_text("broken")
    before = contents(tmp_path)
    assert cli.main(["export", str(folder)]) == 2
    assert f"{folder}/mpm.h5: cannot be read (not HDF5" in capsys.readouterr().err
    assert contents(tmp_path) == before
    assert cli.main(["export", str(folder / "dem.h5"), "--out", str(tmp_path / "out")]) == 0
    assert len(list((tmp_path / "out" / "dem").glob("*.vtu"))) == 3


def test_a_card_that_was_not_calibrated_is_not_lost(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(calibrate.calibration, "evidence", no_work)
    shutil.copy(ROOT / "cases" / "materials" / "seed_table1.toml", tmp_path)
    before = contents(tmp_path)
    words = ["calibrate", "--card", "seed_table1", "--out", str(tmp_path)]
    assert cli.main(words) == 2
    assert "not made by calibrate" in capsys.readouterr().err and contents(tmp_path) == before
    shutil.copy(ROOT / "cases" / "materials" / "dem_mu05.toml", tmp_path)
    with pytest.raises(Worked):
        cli.main(["calibrate", "--card", "dem_mu05", "--out", str(tmp_path)])
    with pytest.raises(Worked):
        cli.main([*words, "--replace"])


class Worked(Exception):
    pass


def no_work(*_, **__):
    raise Worked


# Commands that work for long before they write: their words, where FILE is what is in their way.
LONG: dict[str, list[str]] = {
    "frontier": ["frontier", COLUMN, "--out", "FILE"],
    "atlas": ["atlas", COLUMN, "--out", "FILE"],
    "ladder": ["ladder", COLUMN, "--out", "FILE"],
    "convergence": ["convergence", "cases/column", "--out", "FILE"],
    "collapse": ["collapse", COLUMN, "--out", "FILE"],
    "table of a collapse": ["collapse", COLUMN, "--table", "FILE"],
    "table of dimensions": ["dimension", COLUMN, "--table", "FILE"],
    "accuracy": ["accuracy", "--out", "FILE"],
    "element": ["element", "cases/shear", "--quick", "--out", "FILE"],
}


@pytest.mark.parametrize("what", LONG)
def test_what_is_in_the_way_is_found_before_the_work(tmp_path, monkeypatch, capsys, what):
    (tmp_path / "notes").write_text("mine")
    words = [word.replace("FILE", str(tmp_path / "notes")) for word in LONG[what]]
    monkeypatch.chdir(ROOT)
    for name in ("collapse.run_stages", "dimension.run_stages", "accuracy.drive"):
        monkeypatch.setattr(f"compare.commands.{name}", no_work)
    for name in ("study.reference.obtain", "study.sweep.sweep", "element.campaign.run_point"):
        monkeypatch.setattr(f"compare.{name}", no_work)
    assert cli.main(words) == 2
    line = capsys.readouterr().err
    assert line.startswith(f"{tmp_path / 'notes'}: ") and line.count("\n") == 1
    assert contents(tmp_path) == {"notes": b"mine"}


@pytest.mark.parametrize("check", [files.check_table, dimension.check_rows, accuracy.check_figure])
def test_a_folder_is_no_file_to_write(tmp_path, check):
    (tmp_path / "a.svg").mkdir()
    with pytest.raises(CaseError, match="it is a folder"):
        check(tmp_path / "a.svg")


def test_an_earlier_table_is_replaced(tmp_path):
    files.write_table(tmp_path / "t.csv", ["command: c"], [{"a": 1}])
    files.check_table(tmp_path / "t.csv")
    with pytest.raises(CaseError, match="of another command"):
        dimension.check_rows(tmp_path / "t.csv")


def test_programs_of_the_grains_say_it_in_a_line_too(tmp_path):
    (tmp_path / "notes").write_text("mine")
    words = [sys.executable, "-m", splits.__name__, "nowhere.h5", "-o", str(tmp_path / "notes")]
    done = subprocess.run(words, capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 2 and "no table of grainpair" in done.stderr
    assert done.stderr.count("\n") == 1 and contents(tmp_path) == {"notes": b"mine"}


# Programs that write one file each.
POINT = f"""case = "{COLUMN}"
[start]
stress = [1e3, 2e3, 1e3, 0, 0, 0]
[[leg]]
path = "strain"
duration = 0.01
rate = [0, 0, 0, 1, 0, 0]
steps = 1000000
"""


@pytest.fixture
def programs(tmp_path):
    (tmp_path / "path.toml").write_text(POINT)
    write_run(tmp_path / "run.h5", "mpm", frames=2)
    grains = [sys.executable, "-m", "dem_reference.run", COLUMN, "--quiet"]
    return {
        "mpm_run": [program("mpm_run"), COLUMN, "--quiet"],
        "mpm_point": [program("mpm_point"), tmp_path / "path.toml"],
        "grain_map": [program("grain_map"), tmp_path / "run.h5", "--quiet"],
        "grains": [*grains, "--packings", tmp_path / "packings"],
    }


def start(command: list, **more) -> subprocess.Popen:
    return subprocess.Popen(
        [str(word) for word in command],
        cwd=ROOT,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        **more,
    )


@pytest.mark.parametrize("name", ["mpm_run", "grains"])
def test_a_file_has_one_owner_and_the_next_clears_up_after_a_killed_one(tmp_path, programs, name):
    out = tmp_path / "out" / "result.h5"
    out.parent.mkdir()
    command = [*programs[name], "-o", out]
    first = start(command)
    lock = out.parent / ".result.h5.lock"
    while not lock.exists() or not lock.read_text():
        assert first.poll() is None
        time.sleep(0.01)
    second = start(command)
    assert second.wait(timeout=60) == 2 and second.stderr
    line = second.stderr.read()
    assert line.startswith(f"{out}: in use by process {first.pid} (started ")
    assert line.count("\n") == 1
    first.send_signal(signal.SIGKILL)
    first.wait()
    assert contents(out.parent)  # it had no time to clear up
    third = start([*command, "--set", "time.maximum=0.2"])
    assert third.wait(timeout=120) == 0
    assert set(contents(out.parent)) == {"result.h5"}


@pytest.mark.parametrize("name", ["mpm_run", "mpm_point", "grain_map", "grains"])
@pytest.mark.parametrize("where", ["a folder", "/proc/x", "nowhere"])
def test_a_program_says_that_its_file_cannot_be_written(tmp_path, programs, name, where):
    if where == "nowhere" and name == "grains":
        pytest.skip("makes its folders")
    out = {"a folder": tmp_path, "/proc/x": Path("/proc/x"), "nowhere": tmp_path / "no" / "x.h5"}
    before = contents(tmp_path)
    done = start([*programs[name], "-o", out[where]])
    assert done.wait(timeout=60) == 2 and done.stderr
    line = done.stderr.read()
    assert line.startswith(f"{out[where]}: cannot be written (") and line.count("\n") == 1
    assert contents(tmp_path) == before


def file_size(most: int):
    """To be called in a child: files may not grow beyond `most` bytes, as on a full disk."""

    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))

    return limit


@pytest.mark.parametrize("name, most", [("mpm_run", 500_000), ("mpm_run", 1000), ("grain_map", 0)])
def test_a_full_disk_is_one_line_and_leaves_nothing(tmp_path, programs, name, most):
    out = tmp_path / "out" / "result.h5"
    out.parent.mkdir()
    more = {"preexec_fn": file_size(most), "restore_signals": False}
    done = start([*programs[name], "-o", out], **more)
    assert done.wait(timeout=60) == 3 and done.stderr
    line = done.stderr.read()
    assert line.startswith(f"{out}: no room (File too large, ") and line.count("\n") == 1
    assert not contents(out.parent)


def fail_to_write(folder, report):
    raise OSError(28, os.strerror(28), str(folder / "dem.h5"))


def crash(folder, report):
    os.kill(os.getpid(), signal.SIGSEGV)


def test_a_full_disk_under_the_grains_is_called_that(tmp_path, monkeypatch):
    with pytest.raises(EngineError, match=r"dem.h5: no room \(No space left"):
        process.run_engine(fail_to_write, tmp_path, log=tmp_path / "log")
    with pytest.raises(EngineError, match="stopped with code -11"):
        process.run_engine(crash, tmp_path, log=tmp_path / "log")
    monkeypatch.setattr(process.room, "free", lambda _: 0.0)
    with pytest.raises(EngineError, match=r"no room \(No space left on device, 0 MB free\)"):
        process.run_engine(crash, tmp_path, log=tmp_path / "log")


def test_a_small_file_on_a_full_disk_is_one_line(tmp_path, monkeypatch):
    def full(*_, **__):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(EngineError, match=r"t.csv: no room \(No space left.* free some"):
        files.write_atomically(tmp_path / "t.csv", "text")
    assert not contents(tmp_path)
