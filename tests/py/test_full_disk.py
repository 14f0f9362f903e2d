"""Where room runs out, an earlier result stands, one line says so, and nothing else is left.

A few sizes of a small file system per program; 60 of each with GRAINPAIR_FULL_DISK=60.
"""

import ctypes
import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from foreign_block import write
from full_disk import Disk, Done, forked, started
from synthetic import write_pair
from test_writers import DONE, POINT, contents, file_size
from watched import seen

from cases import files, openpmd, room
from cases.errors import CaseError, EngineError, exit_code
from cases.programs import ROOT, module, program
from cases.reading import opened
from compare import __main__ as cli
from compare.report import report, vtk
from dem_reference import run

LOADED = (report, vtk)  # so that copies of this process have them
SIZES = int(os.environ.get("GRAINPAIR_FULL_DISK", 0))
COLUMN = str(ROOT / "cases" / "column_ci")
EARLIER = b"# what was there before\n"
SHORT = [COLUMN, "--quiet", "--set", "time.maximum=0.2"]
# More frames of fewer points than the estimate of its room is made for: it does run out.
SPARSE = [*SHORT, "--set", "mpm.cell_size=0.004", "--set", "time.frame_interval=0.02"]
IMPORT = ["import", "FILES/a.dump", "--time-step=1e-5", "--density=2500", "--force", "--quiet"]

# Programs that write into the folder OUT, and read from FILES: what was there before, their words,
# and how many sizes they are tried with.
WRITERS: dict[str, tuple[list[str], list[str], int]] = {
    "mpm_run": (["r.h5"], ["mpm_run", *SPARSE, "-o", "OUT/r.h5"], 8),
    "mpm_run, refused": (["r.h5"], ["mpm_run", *SHORT, "-o", "OUT/r.h5"], 8),
    "mpm_point": (["r.h5"], ["mpm_point", "FILES/path.toml", "-o", "OUT/r.h5"], 8),
    "mpm_point, CSV": (["r.csv"], ["mpm_point", "FILES/path.toml", "-o", "OUT/r.csv"], 8),
    "mpm_steady": (
        ["r.h5"],
        ["mpm_steady", COLUMN, "--conditions", "FILES/given.h5", "-o", "OUT/r.h5"],
        4,
    ),
    "grain_map": (
        ["r.h5"],
        ["grain_map", "FILES/run/mpm.h5", "FILES/run/dem.h5", "--quiet", "-o", "OUT/r.h5"],
        8,
    ),
    "grains": (["r.h5"], ["run", *SHORT, "-o", "OUT/r.h5"], 3),
    "grains, script": (["r.h5"], ["run", *SHORT, "--driver=script", "-o", "OUT/r.h5"], 3),
    "table": (["r.csv"], ["table", "OUT/r.csv"], 8),
    "compare": (
        ["report.html", "fields.h5", "metrics.json", "figures/a.svg"],
        ["compare", "OUT", "--quiet"],
        3,
    ),
    "export": (["mpm.pvd", "mpm/0.vtu"], ["export", "FILES/run", "--out", "OUT"], 8),
    "import": (["r.h5"], [*IMPORT, "-o", "OUT/r.h5"], 8),
    "map": (["fields.h5", "map.html"], ["map", "FILES/run/dem.h5", "--quiet", "--out", "OUT"], 2),
}


def table(words: list[str]) -> int:
    """As the studies and element tests write theirs."""
    rows = [{"a": k, "b": k / 7} for k in range(3000)]
    return exit_code(lambda: files.write_table(Path(words[0]), ["command: c"], rows) or 0)


PYTHON: dict[str, Callable[[list[str]], int]] = {
    "run": run.main,
    "table": table,
}  # what is no command of the launcher


@pytest.fixture(scope="module")
def given(tmp_path_factory) -> Path:
    """What the programs read."""
    folder = tmp_path_factory.mktemp("given")
    write_pair(folder / "run", mpm={"frames": 2}, dem={"frames": 2})
    write(folder / "a.dump")
    (folder / "path.toml").write_text(POINT.replace("1000000", "1000"))
    with h5py.File(folder / "given.h5", "w") as file:
        file["pressure"], file["shear_rate"] = np.full((2, 300), [[1e3], [1.0]])
    return folder


@pytest.fixture(scope="module")
def packings(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("packings")


class Writer:
    """A program that writes into `folder`, in which there is an earlier result."""

    def __init__(self, name: str, folder: Path, given: Path, packings: Path):
        self.earlier, words, self.sizes = WRITERS[name]
        self.folder, self.out = folder, folder / "out"
        places = {"OUT": str(self.out), "FILES": str(given)}
        for word, place in places.items():
            words = [one.replace(word, place) for one in words]
        self.words = words + (["--packings", str(packings)] if words[0] == "run" else [])
        self.out.mkdir()
        if name == "compare":
            for file in (given / "run").iterdir():
                shutil.copy(file, self.out)
        self.place_earlier()
        self.before = contents(folder)

    def place_earlier(self):
        for place in self.earlier:
            (self.out / place).parent.mkdir(exist_ok=True)
            (self.out / place).write_bytes(EARLIER)

    def __call__(self, first: Callable = lambda: None) -> Done:
        """Runs it, in whose process `first` is called before."""
        name, *words = self.words
        if name.startswith(("mpm_", "grain_map")):
            return started([str(program(name)), *words], first)

        def main() -> int:
            first()
            return PYTHON[name](words) if name in PYTHON else cli.main(self.words)

        return forked(main)

    def check_refused(self, done: Done):
        """That it ended for want of room, and left everything as it was."""
        assert done.code == 3 and done.said.count("\n") == 1, done
        assert done.said.startswith(str(self.out)) and ": no room (" in done.said, done
        assert done.said.endswith(" MB free) free some room, or write elsewhere\n"), done
        assert contents(self.folder) == self.before

    def check_replaced(self, done: Done):
        assert done.code in DONE and not done.said, done
        assert (self.out / self.earlier[0]).read_bytes() != EARLIER


@pytest.fixture
def quick(monkeypatch):
    """A report of one figure, unless time is given."""
    if not SIZES:
        monkeypatch.setattr(report, "all_charts", lambda some=report.all_charts()[:1]: some)


@pytest.mark.parametrize("name", WRITERS)
def test_whatever_the_room_an_earlier_result_stands_until_the_new_one_is_complete(
    tmp_path, given, packings, quick, name
):
    with Disk(tmp_path / "ample") as disk:  # the control: with room it is replaced
        writer = Writer(name, disk.folder, given, packings)
        done, most = disk.peak_of(writer)
        writer.check_replaced(done)
    sizes = np.linspace(0.0, 1.1 * most, SIZES or writer.sizes)
    refused = 0
    for size in sizes:
        with Disk(tmp_path / f"{size:.0f}") as disk:
            writer = Writer(name, disk.folder, given, packings)
            disk.leave(size)
            done = writer()
            if done.code not in DONE:
                writer.check_refused(done)
                refused += 1
    print(f"{name}: {refused} of {len(sizes)} sizes up to {1.1e-6 * most:.2g} MB were too small")
    assert refused >= len(sizes) / 2  # most of them are less than it took


@pytest.mark.parametrize("name", ["mpm_run", "mpm_point, CSV", "grain_map", "import"])
def test_where_files_may_not_grow_it_is_the_same(tmp_path, given, packings, name):
    """The everyday stand-in, which needs no file system of its own; MPI's would be too short for
    the grains.
    """
    (tmp_path / "ample").mkdir()
    writer = Writer(name, tmp_path / "ample", given, packings)
    writer.check_replaced(writer(file_size(2**30)))
    largest = (writer.out / writer.earlier[0]).stat().st_size
    for share in (0.0, 0.4, 0.95):
        folder = tmp_path / f"{share}"
        folder.mkdir()
        writer = Writer(name, folder, given, packings)
        done = writer(file_size(int(share * largest)))
        writer.check_refused(done)
        assert "File too large" in done.said


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6, 0.9, 0.99])
def test_what_hdf5_writes_late_is_missed_too(tmp_path, share):
    """Small arrays and attributes reach a file of h5py's only as it is closed."""

    def fill(path: Path):
        with openpmd.create(path, "dem", {"case": "c"}) as file:
            for step in range(20):
                cloud = openpmd.frame(file, step, float(step), 1.0).create_group("particles/cloud")
                openpmd.record(cloud, "mass", np.ones(50), "kg", float, level=step % 2)

    fill(tmp_path / "whole.h5")
    with h5py.File(tmp_path / "whole.h5") as file:
        assert len(file["data"]) == 20
    most = int(share * (tmp_path / "whole.h5").stat().st_size)

    def main() -> int:
        file_size(most)()
        with room.enough(tmp_path / "r.h5"):
            fill(tmp_path / "r.h5")
        return 0

    done = forked(lambda: exit_code(main))
    assert done.code == 3 and done.said.count("\n") == 1 and "File too large" in done.said, done


def test_other_failures_are_not_put_down_to_the_disk(tmp_path):
    with pytest.raises(ValueError), room.enough(tmp_path):
        raise ValueError
    with pytest.raises(PermissionError), room.enough(tmp_path):
        raise PermissionError(13, "")
    room.refuse_lack(tmp_path / "a" / "b", 1.0)
    with pytest.raises(EngineError, match="b: no room .needs about 1e.15 MB, "):
        room.refuse_lack(tmp_path / "a" / "b", 1e21)


def unmark(path: Path):
    """As `h5clear -s` of Debian's hdf5-tools: HDF5 itself marks a file that it writes, and refuses
    it where the mark has stayed.
    """
    loaded = re.findall(r"/\S*/libhdf5_serial\.so\S*", Path("/proc/self/maps").read_text())
    library = ctypes.CDLL(loaded[0])
    library.H5Fopen.restype, word = ctypes.c_int64, ctypes.c_int64
    access = h5py.h5p.create(h5py.h5p.FILE_ACCESS)
    yes = ctypes.byref(ctypes.c_bool(True))
    assert library.H5Pset(word(access.id), b"clear_status_flags", yes) >= 0
    file = library.H5Fopen(str(path).encode(), 1, word(access.id))
    assert file >= 0 and library.H5Fclose(word(file)) >= 0


@pytest.mark.parametrize("name", ["mpm_run", "run"])
def test_what_a_killed_process_leaves_can_be_read_to_its_last_frame(tmp_path, packings, name):
    words = [COLUMN, "--quiet", "-o", str(tmp_path / "r.h5"), "--set", "time.frame_interval=0.02"]
    if name == "run":
        command = module("dem_reference.run", *words, "--packings", packings)
    else:
        command = [str(program(name)), *words]
    (tmp_path / "r.h5").write_bytes(EARLIER)
    engine = subprocess.Popen(command, cwd=ROOT, start_new_session=True)
    places = {"mpm_run": "r.h5.part", "run": ".r.h5.scratch-*/files/r.h5"}
    while not (left := seen(tmp_path, places[name])) or left[0].stat().st_size < 600_000:
        assert engine.poll() is None
        time.sleep(0.01)
    os.killpg(engine.pid, signal.SIGKILL)  # and its engine with it
    engine.wait()
    assert (tmp_path / "r.h5").read_bytes() == EARLIER
    shutil.copy(left[0], tmp_path / "kept.h5")
    if name == "mpm_run":
        with pytest.raises(CaseError, match="cut short"):
            opened(tmp_path / "kept.h5")
        unmark(tmp_path / "kept.h5")
    with opened(tmp_path / "kept.h5") as file:
        frames = sorted(file["data"], key=int)
        count = len(file["data/0/particles/cloud/mass"])
        assert len(frames) > 3
        for frame in frames:
            cloud = file[f"data/{frame}/particles/cloud"]
            assert np.all(cloud["mass"][:] > 0.0) and len(cloud["position/x"][:]) == count
        assert "end_reason" not in file.attrs and "energy" not in file
