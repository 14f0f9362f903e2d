"""Our result files are openPMD, and what is not is found."""

import h5py
import numpy as np
import pytest
from openpmd import violations
from synthetic import write_run

from cases import openpmd as written
from cases.programs import call, module, program

COLUMN = "cases/column_ci"
SHORT = ("--set", "time.maximum=0.02", "--set", "time.frame_interval=0.02", "--quiet")


@pytest.fixture(scope="module")
def example(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("run") / "mpm.h5", "mpm", frames=2)


@pytest.fixture(scope="module")
def grains(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dem")
    words = [*module("dem_reference.run"), COLUMN, "-o", folder / "dem.h5", *SHORT]
    done = call([*words, "--packings", folder / "packings"])
    assert done.returncode == 0, done.stderr
    return folder / "dem.h5"


def test_written_examples_of_either_engine(tmp_path, example):
    assert violations(example) == []
    assert violations(write_run(tmp_path / "dem.h5", "dem", frames=2)) == []


def test_a_run_of_the_grains(grains):
    assert violations(grains) == []
    with h5py.File(grains) as file:
        assert file["data/0/contacts/force"].attrs["unitDimension"].tolist()[:3] == [1, 1, -2]
        assert b"3 glued" in file["data/0/particles/cloud/kind"].attrs["doc"]


def test_a_run_of_the_continuum(tmp_path):
    done = call([program("mpm_run"), COLUMN, "-o", tmp_path / "mpm.h5", *SHORT])
    assert done.returncode == 0, done.stderr
    assert violations(tmp_path / "mpm.h5") == []
    with h5py.File(tmp_path / "mpm.h5") as file:
        cloud = file["data/0/particles/cloud"]
        assert b"4 collisional" in cloud["regime"].attrs["doc"]
        assert b"compression positive" in cloud["stress"].attrs["doc"]


def test_text_of_any_length_and_script_comes_back(tmp_path):
    """Attributes beyond 64 kB are what HDF5 refuses in its older format."""
    told = {"source": "a.dump\n" * 20_000, "note": "Schüttgut, ρ g H", "none": ""}
    written.create(tmp_path / "a.h5", "dem", told).close()
    with h5py.File(tmp_path / "a.h5") as file:
        assert {name: file.attrs[name].decode() for name in told} == told
    assert violations(tmp_path / "a.h5") == ["/data: no iterations"]


CLOUD = "data/100/particles/cloud"


def attribute(place: str, name: str, value):
    """Sets an attribute, or removes it where `value` is None."""

    def spoil(file):
        thing = file[place]
        if value is None:
            del thing.attrs[name]
        else:
            thing.attrs[name] = value

    return spoil


def remove(place: str):
    def spoil(file):
        del file[place]

    return spoil


def move(place: str, to: str):
    return lambda file: file.move(place, to)


def shorten(file):
    values, told = file[f"{CLOUD}/mass"][:-1], dict(file[f"{CLOUD}/mass"].attrs)
    del file[f"{CLOUD}/mass"]
    file[f"{CLOUD}/mass"] = values
    file[f"{CLOUD}/mass"].attrs.update(told)


def retype(file):
    values, told = file[f"{CLOUD}/id"][:], dict(file[f"{CLOUD}/id"].attrs)
    del file[f"{CLOUD}/id"]
    file[f"{CLOUD}/id"] = values.astype(np.int32)
    file[f"{CLOUD}/id"].attrs.update(told)


def fold(file):
    values, told = file[f"{CLOUD}/mass"][:], dict(file[f"{CLOUD}/mass"].attrs)
    del file[f"{CLOUD}/mass"]
    file[f"{CLOUD}/mass"] = values[:, None]
    file[f"{CLOUD}/mass"].attrs.update(told)


BYTES = np.bytes_
RULES = {
    "variable length": (attribute("/", "software", "grainpair"), "/@software: text of variable"),
    "of a record too": (attribute(CLOUD, "comment", "none"), "@comment: text of variable"),
    "no version": (attribute("/", "openPMD", None), "/@openPMD: missing"),
    "short version": (attribute("/", "openPMD", BYTES("1.1")), "/@openPMD: b'1.1'"),
    "no base path": (attribute("/", "basePath", None), "/@basePath: missing"),
    "other base path": (attribute("/", "basePath", BYTES("/d/%T/")), "/@basePath: b'/d/"),
    "encoding": (attribute("/", "iterationEncoding", BYTES("no")), "/@iterationEncoding: b'no'"),
    "format": (attribute("/", "iterationFormat", BYTES("a%T")), "/@iterationFormat: b'a%T'"),
    "extension": (attribute("/", "openPMDextension", 0), "/@openPMDextension: no uint32"),
    "number for text": (attribute("/", "softwareVersion", 1.0), "/@softwareVersion: no ASCII"),
    "date": (attribute("/", "date", BYTES("2026-01-01")), "/@date: b'2026-01-01'"),
    "path without end": (attribute("/", "particlesPath", BYTES("particles")), "/@particlesPath: b"),
    "meshes": (attribute("/", "meshesPath", BYTES("meshes/")), "/meshes/: named by meshesPath"),
    "particles": (remove("data/100/particles"), "/particles/: named by particlesPath"),
    "no iterations": (remove("data"), "/data: no iterations"),
    "name of an iteration": (move("data/100", "data/end"), "/data/end: no unsigned integer"),
    "time": (attribute("data/100", "time", None), "/data/100@time: no float"),
    "whole dt": (attribute("data/100", "dt", 1), "/data/100@dt: no float"),
    "unit of time": (attribute("data/100", "timeUnitSI", 1), "/data/100@timeUnitSI: no float64"),
    "name of a record": (move(f"{CLOUD}/mass", f"{CLOUD}/m-0"), "/m-0: name with other"),
    "name of a part": (move(f"{CLOUD}/velocity/x", f"{CLOUD}/velocity/x y"), "/x y: name with"),
    "dimension": (attribute(f"{CLOUD}/mass", "unitDimension", [0.0, 1.0]), "@unitDimension: not 7"),
    "whole powers": (attribute(f"{CLOUD}/mass", "unitDimension", [0] * 7), "@unitDimension: not 7"),
    "offset of time": (attribute(f"{CLOUD}/velocity", "timeOffset", None), "@timeOffset: no float"),
    "unit": (attribute(f"{CLOUD}/velocity/x", "unitSI", None), "/velocity/x@unitSI: no float64"),
    "lengths": (shorten, f"/{CLOUD}: records of different length"),
    "rank": (fold, "/mass: of 2 dimensions"),
    "type of the id": (retype, "/id: no uint64"),
    "no position": (remove(f"{CLOUD}/position"), "/position: missing"),
    "no offset": (remove(f"{CLOUD}/positionOffset"), "/positionOffset: missing"),
    "offset in two": (remove(f"{CLOUD}/positionOffset/z"), "/positionOffset: other components"),
    "no value": (
        attribute(f"{CLOUD}/positionOffset/x", "value", None),
        "/x: a group without value",
    ),
    "shape": (attribute(f"{CLOUD}/positionOffset/x", "shape", [3]), "/x@shape: not one uint64"),
    "not empty": (
        lambda file: file.create_group(f"{CLOUD}/positionOffset/x/y"),
        "/positionOffset/x: a constant component that is not empty",
    ),
}


@pytest.mark.parametrize("rule", RULES)
def test_a_file_that_breaks_a_rule_is_found(tmp_path, example, rule):
    spoil, words = RULES[rule]
    path = tmp_path / "a.h5"
    path.write_bytes(example.read_bytes())
    with h5py.File(path, "r+") as file:
        spoil(file)
    assert any(words in line for line in violations(path)), violations(path)
