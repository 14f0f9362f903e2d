"""Tables of grains: headings of many programs, units, and what is refused."""

import gzip

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cases.errors import CaseError
from compare.importing import headings, registry
from mutations import mutated, read_or_refused

EDEM = (
    "Q01 : Particle ID,Q02 : Particle Position X (mm),Q03 : Particle Position Y (mm),"
    "Q04 : Particle Position Z (mm),Q05 : Particle Velocity X (m/s),"
    "Q06 : Particle Velocity Y (m/s),Q07 : Particle Velocity Z (m/s),"
    "Q08 : Particle Diameter (mm),Q09 : Particle Mass (g),Shape\n"
    "7,1,2,3,0.1,0.2,0.3,2,0.01,sphere\n"
    "9,4,5,6,0,0,-1,3,0.02,sphere\n"
)
PLAIN = "id x y z radius\n1 0 0 0 0.001\n2 0.002 0 0 0.0015\n"
TIMES = "Time,ID,X,Y,Z,R\n0,1,0,0,0,1\n0,2,2,0,0,1\n0.5,2,2,0,1,1\n0.5,1,0,0,1,1\n1.5,1,9,0,0,1\n"


def frames_of(tmp_path, text: str | bytes, name="grains.csv", **options):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    reader = registry.readers()["csv"]
    if "columns" not in options:
        assert registry.reader_of(path, ("grains", "contacts")) is reader
    return list(reader.frames(path, options))


def refused(tmp_path, text: str | bytes, **options) -> str:
    with pytest.raises(CaseError) as error:
        frames_of(tmp_path, text, **options)
    return str(error.value)


@pytest.mark.parametrize(
    "heading, name",
    [
        ("X", "x"),
        ("Position X (m)", "x"),
        ("pos_x", "x"),
        ("Points:2", "z"),
        ("Coordinate : Y [m]", "y"),
        ("velocity_x [m/s]", "vx"),
        ("Absolute Translational Velocity : Z [m/s]", "vz"),
        ("VelocityX", "vx"),
        ("v:1", "vy"),
        ("Angular Velocity X [rad/s]", "omegax"),
        ("omegaz", "omegaz"),
        ("Particle Radius", "radius"),
        ("Diameter (mm)", "diameter"),
        ("Mass", "mass"),
        ("ID", "id"),
        ("Particle ID", "id"),
        ("Time", "time"),
        ("Time Step", "step"),
        ("Stress XX", "sxx"),
        ("sigma_13", "szx"),
        ("Particle Size [m]", None),  # radius or diameter?
        ("Velocity Magnitude", None),
        ("fx", None),
        ("Kinetic Energy", None),
        ("0", None),
    ],
)
def test_headings(heading, name):
    assert headings.meaning(headings.parts(heading)[0]) == name


def test_units_in_brackets(tmp_path):
    (frame,) = frames_of(tmp_path, EDEM)
    columns = frame.columns
    assert frame.units == "si" and frame.time is None
    np.testing.assert_allclose(columns["x"], [1e-3, 4e-3], rtol=1e-15)
    np.testing.assert_allclose(columns["radius"], [1e-3, 1.5e-3], rtol=1e-15)
    np.testing.assert_allclose(columns["mass"], [1e-5, 2e-5], rtol=1e-15)
    np.testing.assert_array_equal(columns["vz"], [0.3, -1])
    np.testing.assert_array_equal(columns["id"], [7, 9])
    assert "Shape" not in columns and "diameter" not in columns


@pytest.mark.parametrize(
    "heading, factor",
    [("vx [mm/s]", 1e-3), ("vx (cm/s)", 1e-2), ("vx (m s^-1)", 1.0), ("density (g/cm^3)", 1e3)],
)
def test_factors(heading, factor):
    (one,) = headings.headings([heading], "here")
    assert one.factor == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize("separator", [",", ";", "\t", " ", "  "])
def test_separators(tmp_path, separator):
    (frame,) = frames_of(tmp_path, PLAIN.replace(" ", separator))
    assert frame.units is None
    np.testing.assert_array_equal(frame.columns["radius"], [0.001, 0.0015])


def test_decimal_commas_and_comments(tmp_path):
    text = "# made by hand\n\nid;x;y;z;radius\r\n1;0,5;0;0;0,25\r\n"
    (frame,) = frames_of(tmp_path, text)
    assert frame.columns["x"].tolist() == [0.5] and frame.columns["radius"].tolist() == [0.25]


def test_compressed(tmp_path):
    (frame,) = frames_of(tmp_path, gzip.compress(PLAIN.encode()), "grains.csv.gz")
    assert len(frame.columns["x"]) == 2


def test_a_time_column_splits_frames(tmp_path):
    frames = frames_of(tmp_path, TIMES)
    assert [frame.time for frame in frames] == [0.0, 0.5, 1.5]
    assert [len(frame.columns["x"]) for frame in frames] == [2, 2, 1]
    assert frames[1].source.endswith(":4") and frames[1].columns["id"].tolist() == [2, 1]


def test_frames_across_the_parts_a_file_is_read_in(tmp_path, monkeypatch):
    monkeypatch.setattr("compare.importing.headed.ROWS", 3)
    frames = frames_of(tmp_path, TIMES)
    assert [len(frame.columns["x"]) for frame in frames] == [2, 2, 1]
    assert frames[1].columns["id"].tolist() == [2, 1]


def test_the_user_names_columns(tmp_path):
    text = "a,b,c,Particle Size [mm]\n1,2,3,4\n"
    (frame,) = frames_of(
        tmp_path, text, columns="x=a [mm],y=b [mm],z=c [mm],diameter=Particle Size"
    )
    assert frame.columns["x"].tolist() == [1e-3] and frame.columns["radius"].tolist() == [2e-3]


@pytest.mark.parametrize(
    "text, options, what",
    [
        ("X,Position X,Y,Z\n1,2,3,4\n", {}, ":1: columns 'X' and 'Position X' could both be x"),
        ("x,y,z,r (mm)\n1,2,3,4\n", {}, "'r (mm)' has a unit, 'x' has none"),
        ("x (furlong),y,z\n1,2,3\n", {}, "unit 'furlong' of a length"),
        ("x,y,z\n1,2,3\n1,2\n", {}, ":3: 2 values instead of 3"),
        ("x,y,z\n1,2,3\n1,2,3,4\n", {}, ":3: 4 values instead of 3"),
        ("x,y,z\n1,2,3\n1,two,3\n", {}, ":3: 'two' is no number"),
        ("x,y,z\n1,2,3\n1,,3\n", {}, ":3: '' is no number"),
        ("x,y,z\n1,2\n", {}, ":2: 2 values below 3 headings"),
        ("x,y,z\n", {}, "no rows below the headings"),
        ("x,y,z,id\n1,2,3,1.5\n", {}, "ids below are not whole numbers"),
        ("x,y,z,t\n1,2,3,0\n1,2,3,1\n1,2,3,0\n", {}, ":4: t 0 was left and comes again"),
        ("a,b,z\n1,2,3\n", {"columns": "x=a,y=q"}, "no line of headings"),
        ("x,y,z\n1,2,3\n", {"columns": "speed=x"}, "--columns 'speed=x': not NAME=COLUMN"),
    ],
)
def test_refused(tmp_path, text, options, what):
    assert what in refused(tmp_path, text, **options)


def test_the_last_frame_of_a_table_that_is_cut_short(tmp_path):
    cut = TIMES[: TIMES.index("0.5,1,0") + 5]
    assert ":5: 2 values instead of 6 (cut short?) --skip-incomplete" in refused(tmp_path, cut)
    notes: list[str] = []
    frames = frames_of(tmp_path, cut, incomplete="drop", notes=notes)
    assert [frame.time for frame in frames] == [0.0] and "left out" in notes[0]


@pytest.mark.parametrize("missing", [1, 8, 9])
def test_a_compressed_table_that_is_cut_short(tmp_path, missing):
    """Whole lines may come out of it all the same: they are not all there were."""
    packed = gzip.compress(TIMES.encode())[:-missing]
    assert "--skip-incomplete" in refused(tmp_path, packed)
    frames = frames_of(tmp_path, packed, incomplete="drop")
    assert [frame.time for frame in frames] == [0.0, 0.5]


@pytest.mark.parametrize(
    "text",
    [b"ITEM: TIMESTEP\n0\nITEM: ATOMS id x y z\n", b"x,y\n1,2\n", b"\0x,y,z\n", b"", b"1 2 3\n"],
)
def test_other_files_are_not_taken(tmp_path, text):
    path = tmp_path / "other"
    path.write_bytes(text)
    assert not registry.readers()["csv"].recognises(path, text)


@settings(max_examples=120, deadline=None)
@given(st.sampled_from([EDEM, PLAIN, TIMES]), st.integers(0, 10**6), st.booleans())
def test_broken_files_are_read_or_refused(tmp_path_factory, text, seed, drop):
    path = tmp_path_factory.mktemp("csv") / "grains.csv"
    path.write_bytes(mutated(text.replace(",", " , ").encode(), seed))
    read_or_refused(registry.readers()["csv"], path, {"incomplete": "drop"} if drop else {})
