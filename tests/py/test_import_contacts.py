"""Contacts joined with imported grains: whom, where, which way, across periodic faces."""

from typing import Any

import h5py
import numpy as np
import pytest

from cases.errors import CaseError
from compare.importing import registry
from compare.importing.contacts import OTHER_WALL
from compare.importing.frame import Box, Frame
from compare.importing.merge import instants
from compare.importing.options import Options
from compare.importing.pipeline import convert
from compare.importing.registry import Reader
from compare.importing.spool import Spool

# Two grains that touch, of radii 1 and 3, one that touches the second across the periodic face
# at x = 10, and one on the floor z = 0; z is up.
PLACES = np.array([[2.0, 5.0, 8.0], [6.0, 5.0, 8.0], [9.5, 5.0, 8.0], [5.0, 5.0, 1.0]])
PLACES[2, 0] = 0.5  # the third: at 0.5, and 10.5 touches nothing; 6 + 3 + 1 > 0.5 + 10 - 6
RADII = np.array([1.0, 3.0, 1.6, 1.0])
BOX = Box(
    np.zeros(3),
    np.array([10.0, 10.0, 50.0]),
    np.array([True, True, False]),
    np.array([[False, False], [False, False], [True, False]]),
)


def frame(step=0, box=BOX, **more) -> Frame:
    columns = {k: v.copy() for k, v in zip("xyz", PLACES.T)}
    columns |= {name: np.zeros(4) for name in ("vx", "vy", "vz")}
    return Frame("grains", columns | {"id": np.arange(1.0, 5.0), "radius": RADII}, step, None, box)


def contacts(step=0, **change) -> Frame:
    """Of the first with the second, and of the second with the third."""
    return Frame("contacts", {}, step, contacts=columns(**change))


def columns(**change) -> dict[str, np.ndarray]:
    return {
        "first": np.array([1.0, 2.0]),
        "second": np.array([2.0, 3.0]),
        "fx": np.array([-3.0, -5.0]),
        "fy": np.zeros(2),
        "fz": np.array([0.5, 0.0]),
    } | change


def named(name: str):
    """Recognises a file that holds its name."""
    return lambda path, head: head == name.encode()


def given(frames: list[Frame]):
    return lambda path, options: iter(frames)


@pytest.fixture
def made(tmp_path, monkeypatch):
    """A function: frames of grains and of contacts → (columns of the contacts in the file, notes).
    Readers of made-up formats stand for the files'.
    """

    def make(grains, touching, **more):
        readers = dict(registry.readers())
        monkeypatch.setattr("compare.importing.registry.READERS", readers)
        for name, frames, holds in (("g", grains, "grains"), ("c", touching, "contacts")):
            (tmp_path / name).write_text(name)
            readers[name] = Reader(name, name, holds, named(name), given(frames))
        out = tmp_path / "grains.h5"
        files = (tmp_path / "g",), (tmp_path / "c",)
        told: dict[str, Any] = {"density": 1.0} | more
        notes = convert(Options(*files, **told), None, out)
        with h5py.File(out) as file:
            group = file["data/0/contacts"]
            vectors = {
                k: np.stack([group[k][a][:] for a in "xyz"], 1)
                for k in ("branch", "position", "force")
            }
            return vectors | {k: group[k][:] for k in ("first", "second")}, notes

    return make


def test_branches_points_and_forces(made):
    """In our axes: x is x, y is z, z is -y."""
    found, notes = made([frame()], [contacts()])
    assert list(found["first"]) == [1, 2] and list(found["second"]) == [2, 3]
    # From the second's centre to the first; the nearest image of the third lies at x = 10.5.
    assert found["branch"] == pytest.approx(np.array([[-4.0, 0, 0], [-4.5, 0, 0]]))
    share = 3.0 / 4.6
    points = np.array([[3.0, 8.0, -5.0], [6.0 + 4.5 * share, 8.0, -5.0]])
    assert found["position"] == pytest.approx(points)
    assert found["force"] == pytest.approx(np.array([[-3.0, 0.5, 0.0], [-5.0, 0.0, 0.0]]))
    assert not any("turned" in note for note in notes)


def test_without_the_periodic_face_the_contact_is_refused(made):
    box = Box(BOX.lower, BOX.upper, np.array([False, True, False]), BOX.fixed)
    one = {"first": 3.0, "second": 2.0, "fx": 5.0, "fy": 0.0, "fz": 0.0}
    stretched = contacts(**{name: np.array([value]) for name, value in one.items()})
    far = frame(box=box)
    far.columns["radius"] = np.array([1.0, 1.0, 1.0, 1.0])
    with pytest.raises(CaseError, match="grains 3 and 2 touch, but are 5.5 m apart"):
        made([far], [stretched], up="z")


def test_forces_on_the_second_are_turned(made):
    other = contacts(fx=np.array([3.0, 5.0]), fz=np.array([-0.5, 0.0]))
    found, notes = made([frame()], [other])
    assert found["force"] == pytest.approx(np.array([[-3.0, 0.5, 0.0], [-5.0, 0.0, 0.0]]))
    assert any(note.startswith("turned: the file has the forces on the second") for note in notes)


def test_forces_of_no_clear_sign_stay_and_are_said(made):
    found, notes = made([frame()], [contacts(fx=np.array([-3.0, 3.0]))])
    assert found["force"][:, 0] == pytest.approx([-3.0, 3.0])
    assert any("repulsion in" in note for note in notes)


def test_walls(made):
    told = contacts(
        first=np.array([1.0, 4.0, -3.0]),
        second=np.array([2.0, 0.0, 4.0]),
        fx=np.array([-3.0, 0.1, 0.0]),
        fy=np.zeros(3),
        fz=np.array([0.0, 2.0, -1.0]),
    )
    found, _ = made([frame()], [told])
    assert list(found["first"]) == [1, 4, 4] and list(found["second"]) == [2, OTHER_WALL, -3]
    assert found["branch"][1:] == pytest.approx(np.array([[0.0, 1.0, 0.0]] * 2))
    assert found["position"][1] == pytest.approx([5.0, 0.0, -5.0])
    assert found["force"][1:] == pytest.approx(np.array([[0.1, 2.0, 0.0], [0.0, 1.0, 0.0]]))


def test_a_told_point_is_kept(made):
    points = {"px": np.array([3.1, 9.2]), "py": np.full(2, 5.0), "pz": np.full(2, 8.0)}
    found, _ = made([frame()], [contacts(**points)])
    assert found["position"][:, 0] == pytest.approx([3.1, 9.2])
    assert found["branch"][:, 0] == pytest.approx([-4.0, -4.5])


def test_contacts_that_are_told_twice_count_once(made):
    twice = {name: np.concatenate([values, values]) for name, values in columns().items()}
    twice["first"][2:], twice["second"][2:] = twice["second"][:2], twice["first"][:2].copy()
    twice["fx"][2:], twice["fz"][2:] = -twice["fx"][:2], -twice["fz"][:2]
    found, notes = made([frame()], [Frame("contacts", {}, 0, contacts=twice)])
    assert len(found["first"]) == 2 and found["force"][:, 0] == pytest.approx([-3.0, -5.0])
    assert any("told twice" in note for note in notes)


def test_of_contacts_after_a_restart_the_later_count(made):
    """Those with walls too, of which a grain may have two with one wall."""
    wall = {"first": 4.0, "second": -1.0, "fx": 0.0, "fy": 0.0, "fz": 2.0}
    told = {name: np.append(values, wall[name]) for name, values in columns().items()}
    before, after = contacts(**told), contacts(**told | {"fz": 2.0 * told["fz"]})
    found, notes = made([frame()], [before, after])
    assert found["force"][:, 1] == pytest.approx([1.0, 0.0, 4.0])
    assert any("the later file's count" in note for note in notes)
    found, notes = made([frame()], [before])
    assert found["force"][:, 1] == pytest.approx([0.5, 0.0, 2.0])


def test_contacts_of_other_instants_are_refused(made):
    with pytest.raises(CaseError, match="other instants than the grains .step 7"):
        made([frame()], [contacts(step=7)])
    with pytest.raises(CaseError, match="a contact of grain 9, which grains lacks"):
        made([frame()], [contacts(second=np.array([2.0, 9.0]))])
    found, notes = made([frame()], [contacts(), contacts(step=7)])
    assert "dropped: 1 frames of contacts whose instant has no grains" in notes
    with pytest.raises(CaseError, match="contacts without fz"):
        lacking = {name: values for name, values in columns().items() if name != "fz"}
        made([frame()], [Frame("contacts", {}, 0, contacts=lacking)])


def test_ids_from_zero_are_shifted_with_their_contacts(made):
    grains = frame()
    grains.columns["id"] = np.arange(4.0)
    told = contacts(first=np.array([0.0, 1.0]), second=np.array([1.0, 2.0]))
    found, notes = made([grains], [told])
    assert list(found["first"]) == [1, 2] and list(found["second"]) == [2, 3]
    assert "turned: ids start at 1 here, at 0 in the file" in notes


def test_frames_without_steps_are_in_the_order_of_the_files(tmp_path):
    spool = Spool(tmp_path)
    notes: list[str] = []
    for _ in range(2):
        one = frame()
        one.step = None
        spool.add(one)
    found = instants(spool, spool.pieces, notes)
    assert [one.step for one in found] == [0, 1] and "order of the files" in notes[0]
    one = frame(step=5)
    spool.add(one)
    with pytest.raises(CaseError, match="no step .other frames have one"):
        instants(spool, spool.pieces, notes)
