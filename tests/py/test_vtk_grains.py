"""Grains of VTK files, legacy and XML, as LIGGGHTS, YADE's recorder and meshio write them."""

import base64
import gzip
import struct
import zlib
from pathlib import Path
from typing import Any

import foreign
import meshio
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cases.errors import CaseError
from compare.importing.frame import Frame
from compare.importing.readers import text_dump, vtk_grains
from compare.importing.registry import reader_of
from tests.fuzz.seeds import vtk_bytes

LEGACY = """# vtk DataFile Version {version}
by hand
ASCII
DATASET POLYDATA
FIELD FieldData 2
TIME 1 1 double
0.25
CYCLE 1 1 int
40
POINTS 3 float
0 1 2 3 4 5
6 7 8
{cells}
POINT_DATA 3
SCALARS radius double
LOOKUP_TABLE default
.1 .2 .3
VECTORS v double
1 2 3
4 5 6
7 8 9
FIELD FieldData 2
id 1 3 vtkIdType
11 12 13
q 4 3 float
1 2 3 4 5 6 7 8 9 10 11 12
METADATA
INFORMATION 0

CELL_DATA 3
SCALARS other int 1
LOOKUP_TABLE default
7
7 7
"""
CELLS = {
    "2.0": "VERTICES 3 6\n1 0\n1 1\n1 2",
    "5.1": "VERTICES 4 3\nOFFSETS vtktypeint64\n0 1 2 3\nCONNECTIVITY vtktypeint64\n0 1 2",
}
POINTS = np.arange(9.0).reshape(3, 3)


@pytest.fixture(name="written")
def fixture_written(tmp_path):
    def written(text: str | bytes, name: str) -> Path:
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return written


def frames(path: Path, options: dict | None = None) -> list[Frame]:
    return list(vtk_grains.frames(path, {} if options is None else options))


def refusal(path: Path, options: dict | None = None) -> str:
    with pytest.raises(CaseError) as refused:
        frames(path, options)
    assert "\n" not in str(refused.value)
    return str(refused.value)


def assert_points(frame: Frame, rtol=0.0):
    for axis, values in zip("xyz", POINTS.T):
        np.testing.assert_allclose(frame.columns[axis], values, rtol=rtol)


@pytest.mark.parametrize("version", CELLS)
def test_legacy_files_are_read(written, version):
    path = written(LEGACY.format(version=version, cells=CELLS[version]), "grains_7.vtk")
    assert reader_of(path, ("grains",)).name == "vtk_grains"
    (frame,) = frames(path)
    assert (frame.time, frame.step, frame.source) == (0.25, 40, str(path))
    assert_points(frame)
    assert frame.columns["vy"].tolist() == [2, 5, 8]
    assert frame.columns["id"].tolist() == [11, 12, 13]
    assert frame.columns["id"].dtype == np.int64
    assert frame.columns["q[4]"].tolist() == [4, 8, 12] and "other" not in frame.columns


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("POLYDATA", "STRUCTURED_GRID", "STRUCTURED_GRID holds no grains"),
        ("ASCII", "ASKII", ":3: 'ASKII' where ASCII or BINARY should be"),
        ("POINTS 3 float", "POINTS 3 quaternion", ":10: POINTS of type quaternion"),
        ("POINTS 3 float", "POINTS 4 float", ":13: POINTS is not all numbers"),
        ("6 7 8", "6 7", ":13: POINTS does not end a line with its number 9"),
        (".1 .2 .3", ".1 .2x .3", "radius is not all numbers"),
        ("4 5 6\n7 8 9", "4 5 6 7 8 9 9", "v does not end a line with its number 9"),
        ("id 1 3", "id 1", "a line that cannot be read"),
        ("id 1 3 vtkIdType\n11 12 13", "id 1 2 int\n11 12", "2 values of id, 3 points"),
        ("11 12 13", "11.5 12 13", "id is not all numbers"),
        ("VECTORS", "VEKTORS", "VEKTORS"),
        ("CONNECTIVITY", "OFFSETS", "where CONNECTIVITY should be"),
    ],
)
def test_what_is_wrong_in_a_legacy_file_is_told(written, old, new, words):
    text = LEGACY.format(version="5.1", cells=CELLS["5.1"])
    assert old in text
    path = written(text.replace(old, new, 1), "g.vtk")
    message = refusal(path)
    assert message.startswith(str(path)) and words in message


@pytest.mark.filterwarnings("error")
def test_a_signalling_nan_is_none_to_numpy_alone(tmp_path):
    """No warning of the cast comes beside the line that refuses the grain."""
    (path := tmp_path / "bytes_3.vtk").write_bytes(
        vtk_bytes()["bytes_3.vtk"].replace(struct.pack(">f", 5.0), b"\x7f\xa0\x00\x00")
    )
    (frame,) = frames(path)
    assert np.isnan(frame.columns["z"]).tolist() == [False, True]


def test_every_cut_of_a_file_is_seen(tmp_path):
    """Of a legacy file: until all the arrays at its points are there. Of XML anywhere."""
    folder = foreign.run_liggghts(tmp_path)
    for name in ("text_1500.vtk", "bytes_1500.vtk", "text_1500.vtp", "bytes_1500.vtu"):
        data = (folder / name).read_bytes()
        whole = frames(folder / name)[0].columns
        for size in np.linspace(1, len(data) - 1, 150).astype(int):
            path = tmp_path / f"cut{Path(name).suffix}"
            path.write_bytes(data[:size])
            try:
                (frame,) = frames(path)
            except CaseError as error:
                assert "\n" not in str(error)
                options: dict = {"incomplete": "drop"}
                if "cut short" in str(error):
                    assert not frames(path, options) and "left out" in options["notes"][0]
                continue
            assert all(np.array_equal(whole[k], frame.columns[k]) for k in whole)
            assert data[size:].isspace() or data[:size].endswith(b">")


def test_all_forms_of_liggghts_are_the_grains_of_its_dump(tmp_path):
    """Seven digits or more in VTK, six in the dump."""
    folder = foreign.run_liggghts(tmp_path)
    (dump,) = text_dump.frames(folder / "l_1500.dump", {})
    want = {name: values[np.argsort(dump.columns["id"])] for name, values in dump.columns.items()}
    for form in ("text", "bytes"):
        for ending in ("vtk", "vtp", "vtu"):
            path = folder / f"{form}_1500.{ending}"
            assert reader_of(path, ("grains",)).name == "vtk_grains"
            options: dict = {}
            (frame,) = frames(path, options)
            order = np.argsort(frame.columns["id"])
            assert frame.columns.keys() == want.keys() - {"ix", "iy", "iz"}
            for name, values in frame.columns.items():
                size = np.abs(want[name]).max() or 1.0
                np.testing.assert_allclose(values[order] / size, want[name] / size, atol=1e-5)
            assert frame.step == 1500 and frame.box is not None and dump.box is not None
            np.testing.assert_allclose(frame.box.lower, dump.box.lower, atol=1e-9)
            np.testing.assert_allclose(frame.box.upper, dump.box.upper, rtol=1e-6)
            assert options["notes"] == [text_dump_note()]
    options = {}
    for name in ("text_boundingBox_1500.vtk", "text_boundingBox_1500.vtr"):
        assert not frames(folder / name, options)
    assert len(options["notes"]) == 1 and "boundingBox" in options["notes"][0]


def text_dump_note() -> str:
    return "the box does not tell its boundaries: none is taken as periodic"


@pytest.mark.parametrize("form", ["ascii", "binary", "zlib", "lzma"])
def test_files_of_meshio_are_read(tmp_path, form):
    """As of YADE's VTKRecorder, by the names of its arrays."""
    rng = np.random.default_rng(2)
    arrays = {
        "radii": rng.random(3),
        "linVelVec": rng.random((3, 3)),
        "angVelVec": rng.random((3, 3)),
        "id": np.array([4, 2, 9]),
        "materialId": np.zeros(3, np.int32),
    }
    mesh = meshio.Mesh(POINTS, [("vertex", np.arange(3)[:, None])], point_data=arrays)
    path = tmp_path / "p-spheres.1200.vtu"
    compression = form if form in ("zlib", "lzma") else None
    meshio.vtu.write(path, mesh, binary=form != "ascii", compression=compression)
    (frame,) = frames(path)
    assert frame.step == 1200 and frame.box is None
    # Ten digits and more in text, all of them in bytes.
    assert_points(frame, rtol=1e-10)
    np.testing.assert_allclose(frame.columns["radius"], arrays["radii"], rtol=1e-10)
    np.testing.assert_allclose(frame.columns["vz"], arrays["linVelVec"][:, 2], rtol=1e-10)
    np.testing.assert_allclose(frame.columns["omegax"], arrays["angVelVec"][:, 0], rtol=1e-10)
    assert frame.columns["id"].tolist() == [4, 2, 9] and "materialId" in frame.columns


@pytest.mark.parametrize("version", ["4.2", "5.1"])
@pytest.mark.parametrize("binary", [True, False])
def test_legacy_grids_of_meshio_are_read(tmp_path, version, binary):
    arrays = {"radius": np.array([0.1, 0.2, 0.3]), "v": 2 * POINTS}
    mesh = meshio.Mesh(POINTS, [("vertex", np.arange(3)[:, None])], point_data=arrays)
    path = tmp_path / "a.vtk"
    meshio.vtk.write(path, mesh, fmt_version=version, binary=binary)
    (frame,) = frames(path)
    assert_points(frame)
    assert frame.columns["vx"].tolist() == [0, 6, 12]
    assert frame.columns["radius"].tolist() == [0.1, 0.2, 0.3] and frame.step is None


def appended(raw: bool, packed: bool, header: str = "UInt64") -> bytes:
    """A .vtp whose arrays are behind the tree."""
    code = "<Q" if header == "UInt64" else "<I"
    arrays = [POINTS.astype("<f4").tobytes(), np.array([3, 1, 2], "<i8").tobytes()]
    data, offsets = b"", []
    for one in arrays:
        offsets.append(len(data))
        parts = [struct.pack(code, len(one)) + one]
        if packed:
            pieces = [zlib.compress(one[:20]), zlib.compress(one[20:])]
            sizes = [2, 20, len(one) - 20, *map(len, pieces)]
            parts = [b"".join(struct.pack(code, size) for size in sizes), b"".join(pieces)]
        data += b"".join(parts if raw else map(base64.b64encode, parts))
    encoding = "raw" if raw else "base64"
    compressor = ' compressor="vtkZLibDataCompressor"' if packed else ""
    tree = (
        f'<?xml version="1.0"?><VTKFile type="PolyData" version="1.0" header_type="{header}" '
        f'byte_order="LittleEndian"{compressor}><PolyData><FieldData><DataArray type="Float64" '
        'Name="TimeValue" NumberOfTuples="1" format="ascii">1.5</DataArray></FieldData>'
        '<Piece NumberOfPoints="3"><Points><DataArray type="Float32" NumberOfComponents="3" '
        f'format="appended" offset="{offsets[0]}"/></Points><PointData><DataArray type="Int64" '
        f'Name="id" format="appended" offset="{offsets[1]}"/><Array type="String" Name="s"/>'
        f'</PointData></Piece></PolyData><AppendedData encoding="{encoding}">\n_'
    )
    return tree.encode() + data + b"\n</AppendedData></VTKFile>\n"


@pytest.mark.parametrize("raw", [True, False])
@pytest.mark.parametrize("packed", [True, False])
@pytest.mark.parametrize("header", ["UInt64", "UInt32"])
def test_appended_arrays_are_read(written, raw, packed, header):
    path = written(appended(raw, packed, header), "a.0030.vtp")
    (frame,) = frames(path)
    assert_points(frame)
    assert frame.columns["id"].tolist() == [3, 1, 2]
    assert (frame.time, frame.step) == (1.5, 30)
    (frame,) = frames(written(gzip.compress(appended(raw, packed, header)), "a.31.vtp.gz"))
    assert frame.step == 31


@pytest.mark.parametrize(
    "old, new, words",
    [
        (b'"PolyData"', b'"ImageData"', "no ImageData in the VTKFile"),
        (b"PolyData", b"ImageData", "ImageData holds no grains"),
        (b'NumberOfPoints="3"', b'NumberOfPoints="4"', "3 points where 4 should be"),
        (b'type="Int64" ', b'type="Int65" ', "no"),
        (b'offset="0"', b'offset="x"', "array cannot be read"),
        (b'offset="0"', b'offset="9999"', "array cannot be read (8 bytes should follow"),
        (b"vtkZLib", b"vtkLZ4", "vtkLZ4DataCompressor is not read"),
        (b"</Piece>", b"</Pierce>", "no whole XML"),
        (b"</AppendedData>", b"</Appended>", "the appended data has no end"),
    ],
)
def test_what_is_wrong_in_xml_is_told(written, old, new, words):
    data = appended(raw=True, packed=True)
    assert old in data
    path = written(data.replace(old, new), "a.vtp")
    if words == "no":  # an array of a type that is not known is passed over, as words are
        assert "id" not in frames(path)[0].columns
    else:
        assert words in refusal(path) and refusal(path).startswith(str(path))


def test_parts_of_a_parallel_file_are_put_together(written):
    data = appended(raw=False, packed=False)
    written(data, "a_0_5.vtp")
    written(data, "a_1_5.vtp")
    text = (
        '<VTKFile type="PPolyData"><PPolyData GhostLevel="0"><Piece Source="a_0_5.vtp"/>'
        '<Piece Source="a_1_5.vtp"/></PPolyData></VTKFile>'
    )
    (frame,) = frames(written(text, "a_5.pvtp"))
    assert frame.step == 5 and frame.columns["id"].tolist() == [3, 1, 2, 3, 1, 2]
    missing = written(text.replace("a_1_5", "a_2_5"), "a_6.pvtp")
    assert "a_2_5.vtp: cannot be read (No such file" in refusal(missing)
    itself = written(text.replace("a_1_5.vtp", "a_7.pvtp"), "a_7.pvtp")
    assert "lists a_7.pvtp as its piece" in refusal(itself)


def test_a_collection_tells_the_times(written):
    written(appended(raw=False, packed=True), "a_10.vtp")
    written(LEGACY.format(version="2.0", cells=CELLS["2.0"]), "a_20.vtk")
    text = (
        '<?xml version="1.0"?><VTKFile type="Collection"><Collection>'
        '<DataSet timestep="0.5" part="0" file="a_10.vtp"/><DataSet timestep="1" file="a_20.vtk"/>'
        "</Collection></VTKFile>"
    )
    path = written(text, "all.pvd")
    assert reader_of(path, ("grains",)).name == "vtk_grains"
    assert [(f.time, f.step) for f in frames(path)] == [(0.5, 10), (1.0, 40)]
    assert "timestep 'soon' is no number" in refusal(written(text.replace("0.5", "soon"), "b.pvd"))
    assert "without a file" in refusal(written(text.replace('file="a_20.vtk"', ""), "c.pvd"))
    assert "gone.vtp: cannot be read" in refusal(written(text.replace("a_10", "gone"), "d.pvd"))


@settings(max_examples=200, deadline=1000)  # [ms]
@given(st.data())
def test_any_damage_gives_grains_or_one_line(tmp_path_factory, data):
    form = data.draw(st.sampled_from(["vtk", "raw", "base64"]))
    text = LEGACY.format(version="5.1", cells=CELLS["5.1"]).encode()
    damaged = bytearray(text if form == "vtk" else appended(form == "raw", packed=True))
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(damaged) - 1))
        damaged[at : at + data.draw(st.integers(0, 3))] = data.draw(st.binary(max_size=3))
    path = tmp_path_factory.getbasetemp() / f"damaged.{'vtk' if form == 'vtk' else 'vtp'}"
    path.write_bytes(damaged)
    try:
        found: list[Any] = frames(path)
    except CaseError as error:
        assert "\n" not in str(error)
    else:
        assert all(len(c) == len(f.columns["x"]) for f in found for c in f.columns.values())
