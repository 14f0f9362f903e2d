"""Result files that cannot be read, and programs that cannot be started, each told by its cause."""

import fcntl
import os
import shutil
import subprocess
import sys

import h5py
import pytest
from synthetic import write_pair

from cases import case, programs, reading
from cases.errors import CaseError, EngineError
from cases.programs import ROOT, program
from cases.reading import opened
from compare.mapping.runs import REGIME, open_run

LOCKED = "cannot be read (another process is writing it; wait until that has ended)"
CAUSES = {
    "none.h5": "cannot be read (No such file or directory)",
    "notes.h5": "cannot be read (not HDF5, or cut short)",
    "pipe.h5": "cannot be read (not a file)",
    "loop.h5": "cannot be read (Too many levels of symbolic links)",
    "locked.h5": LOCKED,
}
READERS: dict[str, list] = {
    "mapping": [program("grain_map"), "FILE", "-o", "fields.h5"],
    "start of the continuum": [
        *(program("mpm_run"), ROOT / "cases" / "column_ci", "--packing", "FILE"),
        *("--set", "initial.state=packing", "-o", "mpm.h5"),
    ],
    "export": [sys.executable, "-m", "compare", "export", "FILE"],
    **{
        name: [sys.executable, "-m", f"dem_reference.{name}", "FILE"]
        for name in ("edge", "splits", "second_opinion")
    },
}


@pytest.fixture
def files(tmp_path):
    """A folder of files that cannot be read; one is being written."""
    (tmp_path / "notes.h5").write_text("no run")
    os.mkfifo(tmp_path / "pipe.h5")
    (tmp_path / "loop.h5").symlink_to("loop.h5")
    with h5py.File(tmp_path / "locked.h5", "w"):
        pass
    with (tmp_path / "locked.h5").open("rb") as held:
        fcntl.flock(held, fcntl.LOCK_EX)  # as HDF5 does
        yield tmp_path


@pytest.mark.parametrize("name", CAUSES)
@pytest.mark.parametrize("reader", [opened, open_run])
def test_a_file_that_cannot_be_read_says_why(files, reader, name):
    with pytest.raises(CaseError) as said:
        reader(files / name)
    assert str(said.value) == f"{files / name}: {CAUSES[name]}"


@pytest.mark.parametrize("name", ["notes.h5", "pipe.h5", "locked.h5"])
@pytest.mark.parametrize("who", READERS)
def test_every_program_says_it_in_one_line(files, who, name):
    done = subprocess.run(
        [str(files / name if word == "FILE" else word) for word in READERS[who]],
        cwd=files,
        capture_output=True,
        text=True,
        timeout=60,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        check=False,
    )
    assert done.returncode == 2, done.stderr
    assert done.stderr.count("\n") == 1 and CAUSES[name] in done.stderr


@pytest.mark.parametrize(
    "mode, words", [(0o644, "cannot be started (Permission denied)"), (None, "no such program")]
)
def test_a_program_that_does_not_start_is_told_in_one_line(tmp_path, monkeypatch, mode, words):
    if mode:
        shutil.copy(program("mpm_case"), tmp_path / "mpm_case")
        (tmp_path / "mpm_case").chmod(mode)
    monkeypatch.setenv("GRAINPAIR_BUILD", str(tmp_path))
    with pytest.raises(EngineError) as said:
        case.load(ROOT / "cases" / "column_ci")
    assert str(said.value).startswith(f"{tmp_path / 'mpm_case'}: {words}")


def test_a_program_of_debian_is_named_with_its_package():
    assert "install the package lammps" in str(programs.unstarted("lmp", FileNotFoundError()))


def test_a_continuum_without_the_account_of_its_regime_is_no_run_of_zero(tmp_path):
    """Files of an older version have it by another name."""
    run = write_pair(tmp_path, mpm={"frames": 2}, dem={"frames": 2}) / "mpm.h5"
    assert REGIME in open_run(run).energy
    with h5py.File(run, "a") as file:
        file.move(f"energy/{REGIME}", "energy/dissipated_by_collisions")
    with pytest.raises(CaseError, match=f"energy/{REGIME} is missing .* run the case again"):
        open_run(run)


@pytest.mark.parametrize("shape", [float("inf"), float("nan"), "many"])
def test_a_constant_whose_shape_is_no_number_is_refused(tmp_path, shape):
    with h5py.File(tmp_path / "file.h5", "w") as file:
        one = file.create_group("mass")
        one.attrs["value"], one.attrs["shape"] = 1.0, shape
        with pytest.raises(CaseError, match="of a shape that is no number"):
            reading.column(file, "mass")
        one.attrs["shape"] = [3]
        assert reading.length(file, "mass") == 3
