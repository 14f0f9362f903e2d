"""Result files that somebody else wrote, or broke: what is wrong with them is told in one line, and
nothing but a CaseError comes out of opening, reading and comparing them.
"""

import shutil

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from synthetic import write_pair

from cases import openpmd
from cases.errors import CaseError
from compare.mapping.contacts import base_friction, largest_overlap
from compare.mapping.clouds import open_grains
from compare.mapping.runs import open_run
from compare.report import report

CLOUD, CONTACTS = "data/100/particles/cloud", "data/100/contacts"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A pair of three frames; the grains have contacts, the last ones with the floor."""
    made = write_pair(tmp_path_factory.mktemp("run"), mpm={"frames": 3}, dem={"frames": 3})
    with h5py.File(made / "dem.h5", "r+") as file:
        for step in file["data"]:
            group = file.create_group(f"data/{step}/contacts")
            count = np.arange(1, 41)
            openpmd.record(group, "first", count, "-", np.int32)
            openpmd.record(group, "second", np.where(count > 30, -3, count + 1), "-", np.int32)
            for name, unit in (("branch", "m"), ("position", "m"), ("force", "N")):
                vectors = np.tile([1e-3, 2e-3, 0.0], (40, 1))
                openpmd.record(group, name, vectors, unit, np.float32)
    return made


@pytest.fixture(scope="module", autouse=True)
def without_figures():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report, "draw_all", lambda *_: [])
        yield


def work(folder):
    """All that reads the files of a folder."""
    for name in ("mpm.h5", "dem.h5"):
        open_grains(folder / name)
        run = open_run(folder / name)
        assert sum(len(cloud.mass) for cloud in run.clouds) > 0
        largest_overlap(run), base_friction(run)
    report.compare(folder)


def spoilt(folder, tmp_path, name, spoil):
    """A copy of the folder with one file spoilt."""
    for file in ("mpm.h5", "dem.h5"):
        shutil.copy(folder / file, tmp_path)
    with h5py.File(tmp_path / name, "r+") as file:
        spoil(file)
    return tmp_path


def test_the_pair_itself_is_read_and_compared(folder, tmp_path):
    work(spoilt(folder, tmp_path, "dem.h5", lambda file: None))
    assert (tmp_path / "report.html").exists()


def put(file, place, values):
    """Other values in place of a dataset, or of anything; its attributes are kept."""
    told = dict(file[place].attrs) if place in file else {}
    if place in file:
        del file[place]
    file[place] = values
    file[place].attrs.update(told)


def changed(place, change):
    return lambda file: put(file, place, change(file[place][()]))


def entry(place, value):
    def spoil(file):
        file[place][1] = value

    return spoil


def attribute(place, name, value):
    def spoil(file):
        file[place].attrs[name] = value

    return spoil


def without(place, name=None):
    def spoil(file):
        if name:
            del file[place].attrs[name]
        else:
            del file[place]

    return spoil


def case_with(old, new):
    def spoil(file):
        text = file.attrs["case_resolved"].decode()
        assert old in text
        file.attrs["case_resolved"] = text.replace(old, new)

    return spoil


def short(values):
    return values[:-1]


def words(values):
    return np.full(len(values), b"one")


BOTH, MPM, DEM = ("mpm.h5", "dem.h5"), ("mpm.h5",), ("dem.h5",)
# name -> files, what is done to one, words of the line that tells it
BAD = {
    "newer": (BOTH, attribute("/", "schema_version", 2), "schema_version is 2 .* newer grainpair"),
    "version in words": (BOTH, attribute("/", "schema_version", "new"), "schema_version is 'new'"),
    "no version that is": (BOTH, attribute("/", "schema_version", np.nan), "schema_version is nan"),
    "no engine": (BOTH, without("/", "engine"), "attribute engine is None"),
    "other engine": (BOTH, attribute("/", "engine", "fem"), "attribute engine is 'fem'"),
    "engine a number": (BOTH, attribute("/", "engine", 1), "attribute engine is 1"),
    "no case": (BOTH, without("/", "case_resolved"), "needs a case .* give --case"),
    "case a number": (BOTH, attribute("/", "case_resolved", 1.0), "case_resolved: not a case"),
    "case cut short": (BOTH, case_with("[grains]", "[grains"), "case_resolved: not a case"),
    "case without height": (BOTH, case_with("height = 0.04", ""), "geometry.height is None"),
    "height below zero": (BOTH, case_with("height = 0.04", "height = -1.0"), "height is -1"),
    "height in words": (BOTH, case_with("height = 0.04", 'height = "h"'), "height = 'h' .no float"),
    "no gravity": (BOTH, case_with("gravity = 9.81", "gravity = 0.0"), "gravity is 0.0 .not > 0"),
    "width not a number": (BOTH, case_with("width = 0.75", "width = nan"), "compare.width is nan"),
    "a word a table": (BOTH, case_with("[walls]", "[walls.base]"), "base = .* .no choice"),
    "date a number": (BOTH, attribute("/", "date", 1), "attribute date is 1 .no text"),
    "seconds in words": (BOTH, attribute("/", "cpu_seconds", "many"), "cpu_seconds is 'many'"),
    "seconds a list": (BOTH, attribute("/", "cpu_seconds_engine", [1.0, 2.0]), "no number"),
    "warnings a number": (BOTH, attribute("/", "warnings", 3), "warnings is 3 .no text"),
    "not UTF-8": (BOTH, attribute("/", "machine", np.bytes_(b"\xff\xfe")), "not a result file"),
    "no data": (BOTH, without("data"), "data: missing"),
    "data of numbers": (BOTH, lambda f: put(f, "data", [1.0]), "data: not a group"),
    "no frames": (BOTH, lambda f: (f.pop("data"), f.create_group("data")), "no frames"),
    "frame in words": (BOTH, lambda f: f.move("data/100", "data/end"), "'end' is no step"),
    "frame below zero": (BOTH, lambda f: f.move("data/100", "data/-1"), "'-1' is no step"),
    "frame a dataset": (BOTH, lambda f: put(f, "data/100", [1.0]), "data/100: not a group"),
    "no time": (BOTH, without("data/100", "time"), "data/100: attribute time is 'missing'"),
    "time in words": (BOTH, attribute("data/100", "time", "late"), "attribute time is 'late'"),
    "time a list": (BOTH, attribute("data/100", "time", [1.0, 2.0]), "attribute time is"),
    "time unknown": (BOTH, attribute("data/100", "time", np.nan), "times .* do not increase"),
    "time runs back": (BOTH, attribute("data/100", "time", -1.0), "times .* do not increase"),
    "no cloud": (BOTH, without(CLOUD), "particles/cloud: missing"),
    "cloud a dataset": (BOTH, lambda f: put(f, CLOUD, [1.0]), "particles/cloud: not a group"),
    "no position": (BOTH, without(f"{CLOUD}/position"), "position/x: missing"),
    "no z": (BOTH, without(f"{CLOUD}/position/z"), "position/z: missing"),
    "no velocity": (BOTH, without(f"{CLOUD}/velocity/y"), "velocity/y: missing"),
    "no mass": (BOTH, without(f"{CLOUD}/mass"), "mass: missing"),
    "renamed": (BOTH, lambda f: f.move(f"{CLOUD}/mass", f"{CLOUD}/m"), "mass: missing"),
    "short x": (BOTH, changed(f"{CLOUD}/position/x", short), "position/x: of length"),
    "short velocity": (BOTH, changed(f"{CLOUD}/velocity/z", short), "velocity/z: of length"),
    "short mass": (BOTH, changed(f"{CLOUD}/mass", short), "of length"),
    "short id": (BOTH, changed(f"{CLOUD}/id", short), "id: of length"),
    "short kind": (DEM, changed(f"{CLOUD}/kind", short), "kind: of length"),
    "short radius": (DEM, changed(f"{CLOUD}/radius", short), "radius: of length"),
    "short stress": (MPM, changed(f"{CLOUD}/stress/xy", short), "stress/xy: of length"),
    "no zx": (MPM, without(f"{CLOUD}/stress/zx"), "stress/zx: missing"),
    "short void ratio": (MPM, changed(f"{CLOUD}/void_ratio", short), "void_ratio: of length"),
    "words for numbers": (BOTH, changed(f"{CLOUD}/mass", words), "mass: not a dataset of numbers"),
    "complex mass": (BOTH, changed(f"{CLOUD}/mass", lambda m: m + 1j), "not a dataset of numbers"),
    "mass of rank 2": (BOTH, changed(f"{CLOUD}/mass", lambda m: m[:, None]), "of 2 dimensions"),
    "mass of rank 0": (BOTH, changed(f"{CLOUD}/mass", lambda m: m[0]), "of 0 dimensions"),
    "mass a group": (BOTH, lambda f: (f.pop(f"{CLOUD}/mass"), f.create_group(f"{CLOUD}/mass")), ""),
    "mass empty": (
        BOTH,
        lambda f: put(f, f"{CLOUD}/mass", h5py.Empty("f")),
        "mass: of 0 dimensions",
    ),
    "NaN in x": (BOTH, entry(f"{CLOUD}/position/x", np.nan), "position/x: row 1 is nan"),
    "infinite v": (BOTH, entry(f"{CLOUD}/velocity/x", np.inf), "velocity/x: row 1 is inf"),
    "no mass in one": (BOTH, entry(f"{CLOUD}/mass", 0.0), "mass: row 1 is 0"),
    "volume below zero": (BOTH, entry(f"{CLOUD}/solid_volume", -1.0), "solid_volume: row 1 is -1"),
    "NaN in the stress": (MPM, entry(f"{CLOUD}/stress/xx", np.nan), "stress/xx: row 1 is nan"),
    "millimetres": (
        BOTH,
        attribute(f"{CLOUD}/position/x", "unitSI", 1e-3),
        "position/x: unitSI is 0.001 .only SI",
    ),
    "offset": (
        BOTH,
        attribute(f"{CLOUD}/positionOffset/y", "value", 1.0),
        "positionOffset: not zero",
    ),
    "offset in words": (BOTH, attribute(f"{CLOUD}/positionOffset/y", "value", "a"), "of numbers"),
    "offset of others": (
        BOTH,
        attribute(f"{CLOUD}/positionOffset/y", "shape", [3]),
        "positionOffset/y: of length 3",
    ),
    "no energy": (BOTH, without("energy"), "energy: missing"),
    "energy a dataset": (BOTH, lambda f: put(f, "energy", [1.0]), "energy: not a group"),
    "no energy time": (BOTH, without("energy/time"), "energy/time: missing"),
    "no kinetic": (BOTH, without("energy/kinetic"), "energy/kinetic is missing"),
    "no potential": (BOTH, without("energy/potential"), "energy/potential is missing"),
    "no regime 4": (MPM, without("energy/dissipated_regime_4"), "regime_4 is missing .* run the"),
    "short kinetic": (BOTH, changed("energy/kinetic", short), "energy/kinetic: of length"),
    "short time": (BOTH, changed("energy/time", short), "of length"),
    "NaN in kinetic": (BOTH, entry("energy/kinetic", np.nan), "energy/kinetic: row 1 is nan"),
    "energy of rank 2": (
        BOTH,
        changed("energy/potential", lambda e: e[None, :]),
        "potential: of 2 dimensions",
    ),
    "energy in words": (BOTH, changed("energy/dissipated", words), "dissipated: not a dataset of"),
    "energy runs back": (BOTH, changed("energy/time", lambda t: t[::-1]), "times that do not incr"),
    "a group of energies": (BOTH, lambda f: f.create_group("energy/more"), "more: not a dataset"),
    "contacts a dataset": (DEM, lambda f: put(f, CONTACTS, [1.0]), "contacts: not a group"),
    "no second": (DEM, without(f"{CONTACTS}/second"), "contacts/second: missing"),
    "short second": (DEM, changed(f"{CONTACTS}/second", short), "contacts/second: of length"),
    "short branch": (DEM, changed(f"{CONTACTS}/branch/x", short), "branch/x: of length"),
    "no branch": (DEM, without(f"{CONTACTS}/branch"), "branch/x: missing"),
    "no force": (DEM, without(f"{CONTACTS}/force/y"), "force/y: missing"),
    "NaN in the force": (DEM, entry(f"{CONTACTS}/force/x", np.nan), "force/x: row 1 is nan"),
    "stranger": (DEM, entry(f"{CONTACTS}/first", 10**6), "of a grain 1000000 that is not in its"),
    "strange partner": (DEM, entry(f"{CONTACTS}/second", 10**6), "of a grain 1000000"),
}


@pytest.mark.parametrize(
    "name, what", [(name, what) for what, (names, *_) in BAD.items() for name in names]
)
def test_what_is_wrong_is_said_in_one_line(folder, tmp_path, name, what):
    _, spoil, told = BAD[what]
    run = spoilt(folder, tmp_path, name, spoil)
    with pytest.raises(CaseError, match=told) as said:
        work(run)
    assert str(said.value).startswith(f"{run / name}:")
    assert "\n" not in str(said.value)


def test_an_old_file_without_version_and_attributes_is_read(folder, tmp_path):
    def spoil(file):
        for name in ("schema_version", "commit", "seed", "date", "cpu_seconds", "command"):
            del file.attrs[name]

    work(spoilt(folder, tmp_path, "dem.h5", spoil))


def test_grains_without_a_case_are_opened_but_are_no_run(folder, tmp_path):
    def spoil(file):
        del file.attrs["case_resolved"], file["energy"]
        file["data/100"].attrs["time"] = np.nan  # not told

    path = spoilt(folder, tmp_path, "dem.h5", spoil) / "dem.h5"
    found = open_grains(path)
    assert (found.engine, len(found.clouds), np.isnan(found.time).sum()) == ("dem", 3, 1)
    with h5py.File(path) as file:
        assert np.array_equal(found.clouds[0].mass, file["data/0/particles/cloud/mass"][:])
    with pytest.raises(CaseError, match="needs a case"):
        open_run(path)


def things(path) -> list[str]:
    """All groups and datasets of a file that anybody reads, but one frame of several."""
    found: list[str] = []
    with h5py.File(path) as file:
        file.visit(lambda name: None if name.startswith("data/200/") else found.append(name))
    return found


VALUES = st.one_of(
    st.sampled_from([np.nan, np.inf, -np.inf, 0.0, -1.0, 1e300, "", "word", [], [1.0, 2.0]]),
    st.integers(-(2**31), 2**31),
)


@st.composite
def spoiling(draw, places: list[str]):
    """Something done to a random object of a file: told as text, so that a failure can be read."""
    return (
        draw(st.sampled_from(places)),
        draw(
            st.sampled_from(["remove", "shorten", "value", "type", "rank", "rename", "attribute"])
        ),
        draw(VALUES),
        draw(st.integers(0, 100)),
    )


def apply(file, place, how, value, row):
    thing = file[place]
    whole = isinstance(thing, h5py.Group)
    if how == "remove":
        del file[place]
    elif how == "rename":
        file.move(place, f"{place}_")
    elif how == "attribute" and len(thing.attrs):
        thing.attrs[list(thing.attrs)[row % len(thing.attrs)]] = value
    elif how == "attribute":
        root = list(file.attrs)
        file.attrs[root[row % len(root)]] = value
    elif whole or how == "type":
        put(file, place, np.bytes_(b"word") if how == "type" else value)
    elif how == "shorten":
        put(file, place, thing[: row % max(len(thing), 1)])
    elif how == "rank":
        put(file, place, np.stack([thing[()]] * 2))
    elif not isinstance(value, (str, list)) and len(thing):
        values = thing[()].astype(float)
        values[row % len(values)] = value
        put(file, place, values)


@pytest.mark.parametrize("name", BOTH)
def test_whatever_is_done_only_a_case_error_comes_out(folder, tmp_path_factory, name):
    places = things(folder / name)

    @settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
    @given(spoiling(places))
    def check(what):
        run = spoilt(folder, tmp_path_factory.mktemp("a"), name, lambda file: apply(file, *what))
        try:
            work(run)
        except CaseError as error:
            assert "\n" not in str(error)

    check()
