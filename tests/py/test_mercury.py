"""Particles and contacts of MercuryDPM, from files written by hand in the documented layout."""

import gzip

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cases.errors import CaseError
from compare.importing import registry
from mutations import mutated, read_or_refused
from tests.fuzz.seeds import FSTAT, PLANE

DATA = """3 0 0 0 0 0.01 0.006 0.02
0.001 0.002 0.003 0.1 0.2 0.3 0.001 0 0 0 1 2 3 0
0.0029 0.002 0.003 -0.1 0 0 0.001 0 0 0 0 0 0 1
0.0099 0.002 0.003 0 0 0 0.001 0 0 0 0 0 0 0
2 0.5 0 0 0 0.01 0.006 0.02
0.001 0.002 0.0031 0.1 0.2 0.3 0.001 0 0 0 1 2 3 0
0.0029 0.002 0.0032 -0.1 0 0 0.001 0 0 0 0 0 0 1
"""


@pytest.fixture
def files(tmp_path):
    (tmp_path / "chute.data").write_text(DATA)
    (tmp_path / "chute.fstat").write_text(FSTAT)
    return tmp_path


def frames_of(path, holds=("grains", "contacts"), **options):
    return list(registry.reader_of(path, holds).frames(path, options))


def test_particles(files):
    first, second = frames_of(files / "chute.data")
    assert (first.time, second.time, len(second.columns["x"])) == (0.0, 0.5, 2)
    columns = first.columns
    np.testing.assert_array_equal(columns["id"], [1, 2, 3])
    np.testing.assert_array_equal(columns["vz"], [0.3, 0, 0])
    np.testing.assert_array_equal(columns["omegay"], [2, 0, 0])
    np.testing.assert_array_equal(columns["type"], [0, 1, 0])
    np.testing.assert_array_equal(first.box.upper, [0.01, 0.006, 0.02])


def test_two_dimensions(tmp_path):
    path = tmp_path / "plane.data"
    path.write_text(PLANE)
    (frame,) = frames_of(path)
    told = {name: values.tolist() for name, values in frame.columns.items()}
    assert told["x"] == [0.5] and told["y"] == [0.25] and told["vy"] == [0.2]
    # DPMBase::outputXBallsDataParticle writes the rotation with its sign turned
    assert told["radius"] == [0.05] and told["omegaz"] == [-4.0] and told["z"] == [0.0]


def test_periodic_from_the_restart_file(files):
    notes: list[str] = []
    assert not frames_of(files / "chute.data", notes=notes)[0].box.periodic.any()
    assert "no restart file" in notes[0]
    (files / "chute.restart").write_text(
        "Boundaries 1\nPeriodicBoundary id 0 normal 1 0 0 scaleFactor 1 distanceLeft 0 "
        "distanceRight 0.01 shift 0.01 0 0\n"
    )
    assert frames_of(files / "chute.data")[0].box.periodic.tolist() == [True, False, False]


def test_contacts_once_each_with_the_force_on_the_first(files):
    first, second = frames_of(files / "chute.fstat")
    found = {
        (int(a), int(b)): k
        for k, (a, b) in enumerate(zip(first.contacts["first"], first.contacts["second"]))
    }
    assert set(found) == {(1, 2), (1, -1), (1, 3)} and not len(second.contacts["first"])
    force = np.stack([first.contacts[f"f{axis}"] for axis in "xyz"], axis=1)
    np.testing.assert_array_equal(force[found[1, 2]], [-5, 0, -2])
    # the wall's normal and tangent point into it: the grain is pushed up, and to the left
    np.testing.assert_array_equal(force[found[1, -1]], [-1, 0, 7])
    np.testing.assert_array_equal(force[found[1, 3]], [3, 0.5, 0])
    assert first.contacts["px"][found[1, 2]] == 0.00195


def test_the_image_of_a_fixed_grain_is_found_by_its_place(files):
    """Of a fixed grain there is one row only, so nothing but its place tells who it is."""
    path = files / "chute.fstat"
    lines = [line for line in FSTAT.splitlines() if not line.startswith("0 2 3")]
    path.write_text("\n".join(lines) + "\n")
    contacts = frames_of(path)[0].contacts
    assert (1, 3) in list(zip(contacts["first"].tolist(), contacts["second"].tolist()))


def test_other_contacts_are_no_twins(files):
    """Two contacts of the same forces, but the same normals, are two."""
    path = files / "chute.fstat"
    path.write_text(
        FSTAT.replace("9.000000001e-4 0 3 0.5 -1 0 0 0 -1 0", "9e-4 0 3 0.5 1 0 0 0 1 0")
    )
    (files / "chute.data").unlink()
    contacts = frames_of(path)[0].contacts
    assert len(contacts["first"]) == 4


@pytest.mark.parametrize(
    "cut, where",
    [
        ("2 0.5 0 0 0 0.01 0.006 0.02\n0.001", ":5: 2 particles announced, 1 rows follow"),
        ("0.0029 0.002 0.0032 -0.1 0 0 0.0", ":5: 2 particles announced, 2 rows follow"),
        ("2 0.5 0 0 0", ":5: not the head of a frame"),
    ],
)
def test_cut_short(files, cut, where):
    path = files / "chute.data"
    path.write_text(DATA[: DATA.index(cut) + len(cut)])
    with pytest.raises(CaseError) as error:
        frames_of(path)
    assert f"{path}{where}" in str(error.value) and "--skip-incomplete" in str(error.value)
    notes: list[str] = []
    kept = frames_of(path, incomplete="drop", notes=notes)
    assert [frame.time for frame in kept] == [0.0] and "left out" in notes[-1]


@pytest.mark.parametrize("text, name", [(DATA, "chute.data"), (FSTAT, "chute.fstat")])
def test_a_compressed_file_that_is_cut_short(tmp_path, text, name):
    path = tmp_path / name
    path.write_bytes(gzip.compress(text.encode())[:-3])
    with pytest.raises(CaseError, match="--skip-incomplete"):
        frames_of(path)
    notes: list[str] = []
    assert len(frames_of(path, incomplete="drop", notes=notes)) == 2
    assert "breaks off" in notes[-1]


@pytest.mark.parametrize(
    "old, new, where",
    [
        ("0.0099 0.002 0.003 0", "0.0099 0.002 0.003 zero", ":4: 'zero' is no number"),
        ("0 0 0 1 2 3 0\n", "0 0 0 1 2 3\n", ":2: 13 values instead of 14"),
        ("3 0 0 0 0 0.01", "4 0 0 0 0 0.01", ":5: 8 values instead of 14"),
    ],
)
def test_refused_by_line(files, old, new, where):
    path = files / "chute.data"
    path.write_text(DATA.replace(old, new, 1))
    with pytest.raises(CaseError) as error:
        frames_of(path)
    assert f"{path}{where}" in str(error.value)


@settings(max_examples=120, deadline=None)
@given(st.sampled_from(["data", "fstat"]), st.integers(0, 10**6), st.booleans())
def test_broken_files_are_read_or_refused(tmp_path_factory, ending, seed, drop):
    folder = tmp_path_factory.mktemp("mercury")
    path = folder / f"run.{ending}"
    path.write_bytes(mutated((DATA if ending == "data" else FSTAT).encode(), seed))
    options = {"incomplete": "drop"} if drop else {}
    read_or_refused(registry.readers()[f"mercury_{ending}"], path, options)
