"""Files of grains that are broken in every way a file can be: each refused in one line."""

import subprocess

import h5py
import numpy as np
import pytest
from grains_file import SCENE, column, write_grains

from cases.programs import program
from compare.mapping.runs import map_fields

CLOUD, CONTACTS = "data/0/particles/cloud", "data/0/contacts"
ARRAYS = [
    *(f"{CLOUD}/{r}/{c}" for r in ("position", "velocity", "angular_velocity") for c in "xyz"),
    *(f"{CLOUD}/{r}" for r in ("id", "kind", "radius", "mass", "solid_volume")),
    *(f"{CONTACTS}/{r}/{c}" for r in ("branch", "position", "force") for c in "xyz"),
    *(f"{CONTACTS}/{r}" for r in ("first", "second")),
]


def replaced(name, make):
    def spoil(f):
        old = f[name][()]
        del f[name]
        f[name] = make(old)

    return spoil


def shortened(old):
    return old[: len(old) // 2]


def one_bad(value):
    def make(old):
        new = old.astype(float)
        new[3] = value
        return new

    return make


def attribute(name, value, where="/"):
    def spoil(f):
        f[where].attrs[name] = value

    return spoil


def removed(name):
    def spoil(f):
        del f[name]

    return spoil


def constant(name, shape):
    def spoil(f):
        del f[name]
        group = f.create_group(name)
        group.attrs.update({"value": 1.0, "shape": shape})

    return spoil


def hollow(name):
    """Claims 10^12 numbers and holds none."""

    def spoil(f):
        del f[name]
        f.create_dataset(name, (10**12,), "f8", chunks=(1024,))

    return spoil


def renamed_step(f):
    f.move("data/0", "data/first")


MUTATIONS = {
    **{f"half of {name}": replaced(name, shortened) for name in ARRAYS},
    **{f"text in {name}": replaced(name, lambda old: [b"a"] * len(old)) for name in ARRAYS[::3]},
    **{f"square {name}": replaced(name, lambda old: np.stack([old, old])) for name in ARRAYS[1::3]},
    **{
        f"no {name}": removed(name)
        for name in ARRAYS
        if not name.endswith(("kind", "mass", "solid_volume"))
    },
    **{f"nan in {name}": replaced(name, one_bad(np.nan)) for name in ARRAYS[::2]},
    **{f"hollow {name}": hollow(name) for name in ARRAYS[::4]},
    **{f"constant {name}": constant(name, [10**9]) for name in ARRAYS[::4]},
    "all of it constant": lambda f: [
        constant(n, [10**9])(f) for n in ARRAYS if n.startswith(CLOUD)
    ],
    "negative mass": replaced(f"{CLOUD}/mass", one_bad(-1.0)),
    "no radius": replaced(f"{CLOUD}/radius", one_bad(0.0)),
    "id twice": replaced(f"{CLOUD}/id", one_bad(1.0)),
    "half an id": replaced(f"{CLOUD}/id", one_bad(0.5)),
    "far away": replaced(f"{CLOUD}/position/y", one_bad(1e30)),
    "far below": replaced(f"{CLOUD}/position/y", one_bad(-1e30)),
    "long branch": replaced(f"{CONTACTS}/branch/y", one_bad(1e30)),
    "strange point": replaced(f"{CONTACTS}/position/y", one_bad(1e9)),
    "unknown first": replaced(f"{CONTACTS}/first", one_bad(123456)),
    "unknown second": replaced(f"{CONTACTS}/second", one_bad(123456)),
    "wall first": replaced(f"{CONTACTS}/first", one_bad(-3)),
    "scalar": replaced(f"{CLOUD}/mass", lambda old: 1.0),
    "structure": replaced(f"{CLOUD}/mass", lambda old: np.zeros(len(old), [("a", "f8")])),
    "group in place of numbers": lambda f: (
        removed(f"{CLOUD}/mass")(f),
        f.create_group(CLOUD + "/mass"),
    ),
    "numbers in place of a group": lambda f: (removed(CLOUD)(f), f.update({CLOUD: [1.0]})),
    "no cloud": removed(CLOUD),
    "no particles": removed("data/0/particles"),
    "no data": removed("data"),
    "data is numbers": lambda f: (removed("data")(f), f.update({"data": [1.0]})),
    "no frames": lambda f: (removed("data")(f), f.create_group("data")),
    "no engine": lambda f: f.attrs.__delitem__("engine"),
    "no time": lambda f: f["data/0"].attrs.__delitem__("time"),
    "text for a time": attribute("time", "noon", "data/0"),
    "two times": attribute("time", [0.0, 1.0], "data/0"),
    "strange engine": attribute("engine", "steam"),
    "engine of many words": attribute("engine", ["dem"] * 50),
    "engine of fixed words": attribute("engine", np.array([b"dem"] * 50)),
    "number for an engine": attribute("engine", 3),
    "newer": attribute("schema_version", 2),
    "text for a version": attribute("schema_version", "one"),
    "short periods": attribute("periodic", np.array([1, 0], np.int8)),
    "text for periods": attribute("periodic", "xz"),
    "short walls": attribute("wall_low", [0.0]),
    "infinite wall": attribute("wall_low", [np.nan, -np.inf, np.nan]),
    "walls crossed": attribute("wall_high", [np.nan, -1.0, np.nan]),
    "no box": lambda f: f["data/0"].attrs.__delitem__("box_lower"),
    "empty box": attribute("box_upper", [0.0, 0.0, 0.0], "data/0"),
    "infinite box": attribute("box_upper", [np.inf, 1.0, 1.0], "data/0"),
    "negative diameter": attribute("diameter", -1.0),
    "no density": attribute("density", 0.0),
    "many diameters": attribute("diameter", [1.0, 2.0]),
    "strange case": attribute("case_resolved", "[geometry"),
    "empty case": attribute("case_resolved", ""),
    "step without number": renamed_step,
    "huge step": lambda f: f.move("data/0", "data/9999999999999999999999"),
    "link to nowhere": lambda f: (
        removed(f"{CLOUD}/id")(f),
        f.__setitem__(f"{CLOUD}/id", h5py.SoftLink("/nothing")),
    ),
    "all glued": replaced(f"{CLOUD}/kind", lambda old: np.full(len(old), 3)),
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    frame = column(n=(4, 6, 4))
    frame["spin"] = np.ones_like(frame["x"])
    return write_grains(tmp_path_factory.mktemp("whole") / "g.h5", [frame], **SCENE)


@pytest.mark.parametrize("name", MUTATIONS)
def test_a_broken_file_is_refused_in_one_line(whole, tmp_path, name):
    path = tmp_path / "g.h5"
    path.write_bytes(whole.read_bytes())
    with h5py.File(path, "r+") as f:
        MUTATIONS[name](f)
    out = tmp_path / "fields.h5"
    done = subprocess.run(
        [program("grain_map"), path, "-o", out], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 2, done
    assert done.stderr.count("\n") == 1 and str(path) in done.stderr
    assert not out.exists()


def test_the_whole_file_is_mapped(whole, tmp_path):
    map_fields([whole], tmp_path / "fields.h5")  # the control of the mutations
