"""Folders and patterns as inputs of an import."""

import h5py
import pytest

from cases.errors import CaseError
from compare.importing import inputs
from compare.importing.options import Options
from compare.importing.pipeline import convert

BOTH = ("grains", "contacts")


def dump(step: int) -> str:
    return (
        f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n1\n"
        "ITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\n"
        f"ITEM: ATOMS id x y z vx vy vz radius density\n1 .5 {0.5 - step * 1e-4} .5 0 0 0 .1 2500\n"
    )


@pytest.fixture
def folder(tmp_path):
    for step in (1000, 900, 20):
        (tmp_path / f"dump.{step}.txt").write_text(dump(step))
    (tmp_path / "log.lammps").write_text("LAMMPS (1 Jan 2024)\n")
    (tmp_path / ".hidden.txt").write_text(dump(3))
    (tmp_path / "more").mkdir()
    return tmp_path


def names(found) -> list[str]:
    return [path.name for path in found]


ORDER = ["dump.20.txt", "dump.900.txt", "dump.1000.txt"]


def test_a_folder_has_its_files_in_the_order_of_their_steps(folder):
    found, notes = inputs.files([folder], BOTH)
    assert names(found) == ORDER
    assert notes == [f"passed over: log.lammps (in {folder}, of no known format)"]


def test_a_pattern_has_its_files_in_the_order_of_their_steps(folder):
    assert names(inputs.files([folder / "dump.*.txt"], BOTH)[0]) == ORDER
    with pytest.raises(CaseError, match=r"\*\.gz: no file has such a name"):
        inputs.files([folder / "*.gz"], BOTH)


def test_a_file_that_looks_like_a_pattern_is_a_file(folder):
    odd = folder / "dump[1].txt"
    odd.write_text(dump(1))
    assert inputs.files([odd], BOTH)[0] == [odd]


def test_a_file_that_is_named_twice_is_read_once(folder):
    found, _ = inputs.files([folder / "dump.900.txt", folder], BOTH)
    assert sorted(names(found)) == sorted(ORDER)


def test_a_folder_without_anything_to_read(folder):
    with pytest.raises(CaseError) as error:
        inputs.files([folder / "more"], BOTH)
    assert str(error.value).startswith(f"{folder / 'more'}: no file with grains or contacts")
    (folder / "more" / "notes.md").write_text("nothing")
    with pytest.raises(CaseError, match=r"\(it has 1\) name the files"):
        inputs.files([folder / "more"], BOTH)


def test_files_that_a_list_names_are_not_read_beside_it(tmp_path):
    (tmp_path / "a.pvd").write_text(
        '<VTKFile type="Collection"><Collection><DataSet timestep="0" file="a_0.vtu"/></Collection>'
        "</VTKFile>"
    )
    for name in ("a_0.vtu", "b.vtu"):
        (tmp_path / name).write_text('<VTKFile type="UnstructuredGrid"></VTKFile>')
    assert names(inputs.files([tmp_path], BOTH)[0]) == ["a.pvd", "b.vtu"]


def test_a_folder_is_imported(folder):
    notes = convert(Options((folder,), time_step=1e-3), None, folder / "grains.h5")
    assert any(note.startswith("passed over: log.lammps") for note in notes)
    with h5py.File(folder / "grains.h5") as file:
        assert sorted(map(int, file["data"])) == [20, 900, 1000]
        assert file.attrs["source"].count(b"\n") == 2
