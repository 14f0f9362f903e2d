"""Contacts of `dump local`: which columns they are is told by what they hold, or asked for."""

from pathlib import Path
from typing import Any

import foreign
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cases.errors import CaseError
from compare.importing.readers import local_dump, text_dump
from compare.importing.registry import reader_of

FORCE = ("fx", "fy", "fz")


def dump(names: str, rows, step: int = 0, label: str = "ENTRIES") -> str:
    head = f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF {label}\n{len(rows)}\n"
    box = "ITEM: BOX BOUNDS pp pp ff\n0 10\n0 10\n0 10\n"
    lines = (" ".join(f"{number:.6g}" for number in row) for row in rows)
    return head + box + f"ITEM: {label} {names}\n" + "".join(line + " \n" for line in lines)


@pytest.fixture(name="written")
def fixture_written(tmp_path):
    def written(text: str) -> Path:
        (tmp_path / "c.local").write_text(text)
        return tmp_path / "c.local"

    return written


def contacts(path: Path, options: dict | None = None) -> list[dict[str, Any]]:
    frames = list(local_dump.frames(path, {} if options is None else options))
    assert all(frame.columns == {} for frame in frames)
    return [frame.contacts or {} for frame in frames]


def refusal(path: Path, options: dict | None = None) -> str:
    with pytest.raises(CaseError) as refused:
        contacts(path, options)
    assert "\n" not in str(refused.value)
    return str(refused.value)


class Pairs:
    """Random pairs, a quarter of which do not touch, with all that LAMMPS tells of them."""

    def __init__(self, seed: int = 1, count: int = 40, friction: bool = True):
        rng = np.random.default_rng(seed)
        both = rng.permutation(20 * count)[: 2 * count] + 1
        self.ids = both.reshape(count, 2).astype(float)
        self.branch = rng.normal(size=(count, 3))
        self.normal = self.branch * rng.random((count, 1))
        self.tangential = np.cross(self.branch, rng.normal(size=(count, 3))) * friction
        self.normal[: count // 4] = self.tangential[: count // 4] = 0.0

    def columns(self, words: str) -> np.ndarray:
        size = np.linalg.norm
        parts = {
            "ids": self.ids,
            "types": np.where(self.ids > 400, 2.0, 1.0),
            "dist": size(self.branch, axis=1)[:, None],
            "force": size(self.normal, axis=1)[:, None],
            "eng": np.zeros((len(self.ids), 1)),
            "f": self.normal,
            "p": self.tangential,
            "p4": size(self.tangential, axis=1)[:, None],
            "d": self.branch,
        }
        return np.concatenate([parts[word] for word in words.split()], axis=1)

    def text(self, words: str) -> str:
        """The ids are columns of one compute, the rest of another, both by number alone."""
        table = self.columns(words)
        ids = sum({"ids": 2, "types": 2}.get(word, 0) for word in words.split())
        names = [f"c_q[{i + 1}]" for i in range(ids)]
        names += [f"c_p[{i + 1}]" for i in range(table.shape[1] - ids)]
        return dump(" ".join(names), table)

    def assert_are(self, found: dict, tangential: bool = True):
        """What was found are the pairs that touch; %g has six digits."""
        force = self.normal + self.tangential * tangential
        touching = np.any(force != 0, axis=1)
        assert np.stack([found["first"], found["second"]], 1).tolist() == (
            self.ids[touching].astype(int).tolist()
        )
        got = np.stack([found[name] for name in FORCE], axis=1)
        np.testing.assert_allclose(got, force[touching], rtol=0, atol=2e-5 * np.abs(force).max())


@pytest.mark.parametrize(
    "words",
    [
        "ids dist f p",
        "ids f p",
        "ids dist f p p4",
        "ids types dist eng force f p",
        "ids dist d f p",
        "types ids dist p f",
    ],
)
def test_contacts_of_lammps_are_told_by_what_columns_hold(written, words):
    pairs, options = Pairs(), dict[str, Any]()
    path = written(pairs.text(words))
    assert reader_of(path, ("contacts",)).name == "local_dump"
    (found,) = contacts(path, options)
    pairs.assert_are(found)
    assert found["first"].dtype == np.int64 and "notes" not in options


@pytest.mark.parametrize("words", ["ids dist f", "ids f", "ids force dist f"])
def test_normal_forces_alone_are_said_to_be_that(written, words):
    pairs, options = Pairs(), dict[str, Any]()
    (found,) = contacts(written(pairs.text(words)), options)
    pairs.assert_are(found, tangential=False)
    assert "normal parts alone" in options["notes"][0]


def test_forces_without_friction_are_whole(written):
    pairs = Pairs(friction=False)
    pairs.assert_are(contacts(written(pairs.text("ids dist f p")))[0])


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 12), st.sampled_from(["ids dist f p", "ids f p"]))
def test_few_contacts_are_told_rightly_or_not_at_all(tmp_path_factory, seed, count, words):
    """Wrong columns would be worse than a question."""
    pairs = Pairs(seed, count)
    path = tmp_path_factory.getbasetemp() / "few.local"
    path.write_text(pairs.text(words))
    try:
        (found,) = contacts(path)
    except CaseError as error:
        assert "--contacts" in str(error)
    else:
        pairs.assert_are(found)


def test_an_instant_that_tells_little_is_read_as_a_later_one(written):
    """Of two contacts along axes, with forces zero or positive, nothing can be told."""
    names = " ".join(f"c_q[{i}]" for i in (1, 2)) + " " + " ".join(f"c_p[{i}]" for i in range(1, 8))
    poor = [[1, 2, 0.9, 0, 0, 5, 0, 0, 0], [3, 4, 0.9, 7, 0, 0, 0, 0, 0]]
    assert "--contacts" in refusal(written(dump(names, poor)))
    pairs = Pairs()
    text = dump(names, []) + dump(names, poor, 1) + pairs.text("ids dist f p")
    none, first, second = contacts(written(text))
    assert none["first"].size == none["fz"].size == 0
    assert first["fx"].tolist() == [0, 7] and first["fz"].tolist() == [5, 0]
    pairs.assert_are(second)


def test_pairs_that_do_not_touch_are_no_contacts(written):
    names = "c_q[1] c_q[2] c_p[1] c_p[2] c_p[3] c_p[4]"
    (found,) = contacts(written(dump(names, [[1, 2, 0.9, 0, -0.0, 0], [3, 4, 0.8, 0, 0, 0]])))
    assert {name: found[name].tolist() for name in found} == dict.fromkeys(found, [])


def test_names_tell_without_a_look_at_the_numbers(written):
    rows = [[1, 2, 3, 4, 5, 9], [6, -3, 7, 0, 0, 9]]
    (found,) = contacts(written(dump("id1 id2 fx fy fz torque", rows, label="CONTACTS")))
    assert found["first"].tolist() == [1, 6] and found["second"].tolist() == [2, -3]
    assert [found[name].tolist() for name in FORCE] == [[3, 7], [4, 0], [5, 0]]
    options: dict = {}
    row = [[1, 2, 3, 4, 5, 0.1, 0.2, 0.3]]
    (found,) = contacts(written(dump("patom1 patom2 fx fy fz p1 p2 p3", row)), options)
    assert [found[name].tolist() for name in FORCE] == [[3.1], [4.2], [5.3]]
    assert "tangential" in options["notes"][0]


def test_the_user_may_say_which_columns_they_are(written):
    path = written(dump("a b c d e g h", [[1.5, 7, 8, 1, 2, 3, 4], [1.5, 9, 10, 0, 0, 0, 0]]))
    words = "first=2,second=c,fx=d,fy=5,fz=g+h,px=a,power=7"
    (found,) = contacts(path, {"contacts": words})
    assert {name: values.tolist() for name, values in found.items()} == {
        "first": [7], "second": [8], "fx": [1], "fy": [2], "fz": [7], "px": [1.5], "power": [4]
    }  # fmt: skip
    for wrong, message in {
        "first=2,second=3,fx=4,fy=5": "no fz",
        "first=2,second=3,fx=4,fy=5,fz=9": "no column 9 of numbers (has a, b, c, d, e, g, h)",
        "first=2,torque=3": "'torque=3'",
        "first": "'first'",
        "first=1,second=3,fx=4,fy=5,fz=6": "1.5 is no whole number (first)",
    }.items():
        assert message in refusal(path, {"contacts": wrong})


def test_what_is_ambiguous_is_asked_for(written):
    """Two vectors that could both be the force; ids that none could be; p5 to p10 of LAMMPS."""
    rng = np.random.default_rng(3)
    two = np.concatenate([Pairs().ids, rng.normal(size=(40, 6))], axis=1)
    path = written(dump("c_q[1] c_q[2] " + " ".join(f"c_p[{i}]" for i in range(1, 7)), two))
    hint = 'say which they are: --contacts "first=7,second=8,fx=10,fy=11,fz=12"'
    assert hint in refusal(path) and refusal(path).startswith(f"{path}:9: which columns")
    same = Pairs().columns("ids dist f p")
    same[:, 1] = same[:, 0]
    assert hint in refusal(written(dump(" ".join("abcdefghi"), same)))


@pytest.fixture(name="liggghts", scope="module", params=["id pos force", "all", "parts"])
def fixture_liggghts(request, tmp_path_factory):
    words, columns = {
        "id pos force": ("id pos force", 12),
        "all": ("", 21),  # the manual's default: pos vel id force torque …
        "parts": ("pos id force_normal force_tangential", 15),
    }[request.param]
    return foreign.run_liggghts(tmp_path_factory.mktemp("liggghts"), words, columns)


def grains(path: Path) -> list[dict[str, np.ndarray]]:
    return [frame.columns for frame in text_dump.frames(path, {})]


def imbalance(grain: dict[str, np.ndarray], lists: list[dict[str, Any]]) -> float:
    """The largest difference of a grain's force and the sum of its contacts', of the largest force
    of a grain.
    """
    place = {number: at for at, number in enumerate(grain["id"].tolist())}
    total = np.zeros((len(place), 3))
    for found in lists:
        force = np.stack([found[name] for name in FORCE], axis=1)
        for first, second, one in zip(found["first"].tolist(), found["second"].tolist(), force):
            total[place[first]] += one
            if second > 0:
                total[place[second]] -= one
    own = np.stack([grain[name] for name in FORCE], axis=1)
    return float(np.abs(own - total).max() / np.abs(own).max())


def test_forces_of_liggghts_add_up_to_those_on_the_grains(liggghts):
    """No gravity acts in the script. What LIGGGHTS dumps was computed with velocities of half a
    step before, which its dampers feel: below 0.5 % of the largest force (0.05 % was seen). Without
    the walls, or with a sign turned, it is off by 3 % and more.
    """
    (grain,) = grains(liggghts / "l_1500.dump")
    (pairs,) = contacts(liggghts / "pairs_1500.local")
    (walls,) = contacts(liggghts / "walls_1500.local")
    assert imbalance(grain, [pairs, walls]) < 0.005
    assert imbalance(grain, [pairs]) > 0.02
    assert imbalance(grain, [pairs, {**walls, "fz": -walls["fz"]}]) > 0.02


def test_contacts_with_a_mesh_have_their_place(liggghts):
    (grain,) = grains(liggghts / "l_1500.dump")
    (walls,) = contacts(liggghts / "walls_1500.local")
    assert len(walls["first"]) > 10 and set(walls["second"]) == {-1}
    height = dict(zip(grain["id"].tolist(), grain["z"]))
    np.testing.assert_allclose(walls["pz"], 0.0, atol=1e-12)  # the floor's plane
    np.testing.assert_allclose(walls["bz"], [height[i] for i in walls["first"]], rtol=1e-5)
    assert np.all(walls["fz"] > 0)
    (before,) = contacts(liggghts / "walls_0.local")
    assert before["first"].size == 0


@pytest.mark.parametrize("box", [foreign.BOX, foreign.TILTED])
def test_forces_of_lammps_add_up_to_those_on_the_grains(tmp_path, box):
    """Contacts across the faces of the box too. LAMMPS tells both at one instant; the tangential
    force feels velocities of half a step before (1e-5 was seen). Normal parts alone do not do.
    """
    folder = foreign.run_lammps(tmp_path, box)
    found, normal = contacts(folder / "local.dump"), contacts(folder / "normal.dump")
    for step, grain in enumerate(grains(folder / "plain.dump")):
        assert imbalance(grain, [found[step]]) < 1e-4
        if step:
            assert imbalance(grain, [normal[step]]) > 0.01
        assert len(found[step]["first"]) > 2 * len(grain["id"]) - 20


def test_flags_of_liggghts_decide_pairs_and_walls(written):
    """One row [1, 5, 1]: grains 1 and 5 across the box, or mesh 1, triangle 5 and grain 1."""
    names = " ".join(f"c_x[{i}]" for i in range(1, 7))
    assert "--contacts" in refusal(written(dump(names, [[1, 5, 1, 0.1, -0.2, 0.3]])))
    (pairs,) = contacts(written(dump(names, [[1, 5, 0, 0.1, -0.2, 0.3]])))
    assert (pairs["first"].tolist(), pairs["second"].tolist()) == ([1], [5])
    (walls,) = contacts(written(dump(names, [[2, 0, 7, 0.1, -0.2, 0.3]])))
    assert (walls["first"].tolist(), walls["second"].tolist()) == ([7], [-3])
    assert "px" not in walls


@settings(max_examples=100, deadline=1000)  # [ms]
@given(st.data())
def test_any_damage_gives_contacts_or_one_line(tmp_path_factory, data):
    text = bytearray(Pairs(count=8).text("ids dist f p").encode())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text) - 1))
        text[at : at + data.draw(st.integers(0, 3))] = data.draw(st.binary(max_size=3))
    path = tmp_path_factory.getbasetemp() / "damaged.local"
    path.write_bytes(text)
    try:
        contacts(path)
    except CaseError as error:
        assert "\n" not in str(error)
