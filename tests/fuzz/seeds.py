"""Small good files of every kind that readers take."""

import io
import json
import zlib
from base64 import b64encode
from functools import cache
from struct import pack

import h5py
import numpy as np

from cases.programs import ROOT

BOX = "ITEM: BOX BOUNDS pp fs mm\n0 1\n-1 2\n0 3\n"
TILTED = "ITEM: BOX BOUNDS xy xz yz pp pp ff\n0 1.5 0.5\n0 1 0.2\n0 1 -0.1\n"


def instant(step: int, names: str, rows: list[str], box: str = BOX, label: str = "ATOMS") -> str:
    head = f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF {label}\n{len(rows)}\n"
    return head + box + f"ITEM: {label} {names}\n" + "".join(row + "\n" for row in rows)


GRAINS = ["3 1 .3 .4 .5 .05", "1 2 .1 .2 .3 .06"]
PAIRS = [
    "1 2 0.9 0.1 0.2 0.3 0.5 0.5 0.5",
    "2 3 0.8 -0.1 0.2 1 0.5 0.6 0.7",
    "1 3 1.1 0 0 0 1 1 1",
]
LEGACY = """# vtk DataFile Version 5.1
by hand
ASCII
DATASET POLYDATA
FIELD FieldData 2
TIME 1 1 double
0.25
CYCLE 1 1 int
40
POINTS 2 float
0 1 2 3 4 5
VERTICES 3 2
OFFSETS vtktypeint64
0 1 2
CONNECTIVITY vtktypeint64
0 1
POINT_DATA 2
SCALARS radius double
LOOKUP_TABLE default
.1 .2
VECTORS v double
1 2 3
4 5 6
FIELD FieldData 1
id 1 2 vtkIdType
11 12
METADATA
INFORMATION 0
"""
ANURA = """# vtk DataFile Version 3.0
slope
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 2 float
.1 .2 .3
.4 .5 .6
CELLS 2 4
1 0
1 1
CELL_TYPES 2
1
1
POINT_DATA 2
SCALARS mass_solid float 1
LOOKUP_TABLE default
1.0
2.0
SCALARS porosity float 1
LOOKUP_TABLE default
.4
.4
VECTORS velocity_solid float
1 2 3
4 5 6
TENSORS total_stress_solid float
-9 1 2
1 -8 3
2 3 -7
-9 1 2
1 -8 3
2 3 -7
"""
DATA = """2 0 0 0 0 0.01 0.006 0.02
0.001 0.002 0.003 0.1 0.2 0.3 0.001 0 0 0 1 2 3 0
0.0029 0.002 0.003 -0.1 0 0 0.001 0 0 0 0 0 0 1
1 0.5 0 0 0 0.01 0.006 0.02
0.001 0.002 0.0031 0.1 0.2 0.3 0.001 0 0 0 1 2 3 0
"""
PLANE = "1 2.5 0 0 1 2\n0.5 0.25 0.1 0.2 0.05 0.3 4 1\n"
# Grain 0 touches grain 1 (both rows), the wall -1 below it, and, across the face x = 0, grain 2:
# told once from either side, with the numbers 4 and 3 of their images.
FSTAT = """# 0 1
# 0 0 0 0.01 0.006 0.02
# 0.001 0.001 0 0 0 0
0 0 1 0.00195 0.002 0.003 1e-4 0 5 2 -1 0 0 0 0 -1
0 1 0 0.00195 0.002 0.003 1e-4 0 5 2 1 0 0 -0 0 1
0 0 -1 0.001 0.002 0.002 1e-5 0 7 1 0 0 -1 1 0 0
0 0 4 0.00045 0.002 0.003 9e-4 0 3 0.5 1 0 0 0 1 0
0 2 3 0.01045 0.002 0.003 9.000000001e-4 0 3 0.5 -1 0 0 0 -1 0
# 0.5 1
# 0 0 0 0.01 0.006 0.02
# 0.001 0.001 0 0 0 0
"""
EDEM = """Q01 : Particle ID,Q02 : Particle Position X (mm),Q03 : Particle Position Y (mm),\
Q04 : Particle Position Z (mm),Q05 : Particle Diameter (mm),Q09 : Particle Mass (g),Shape
7,1,2,3,2,0.01,sphere
9,4,5,6,3,0.02,sphere
"""
TIMES = "Time,ID,X,Y,Z,R\n0,1,0,0,0,1\n0,2,2,0,0,1\n0.5,2,2,0,1,1\n0.5,1,0,0,1,1\n"
GERMAN = "id;x [mm];y [mm];z [mm];Radius [mm]\n1;0,5;1,5;2,5;3\n2;0;1;2;4\n"
POINTS = "id x y z vx vy vz mass sxx syy szz sxy syz szx\n1 0 0 0 1 1 1 2 -5 -5 -5 0 0 0\n"
KARAMELO = instant(
    0,
    "id type tag x y z vx vy vz s11 s22 s33 s12 s13 s23 volume mass",
    ["0 1 0 .1 .2 .3 1 2 3 9 8 7 .1 .2 .3 1e-3 2", "1 1 1 .4 .2 .3 1 2 3 9 8 7 .1 .2 .3 1e-3 2"],
    "ITEM: BOX BOUNDS sm sm sm\n0 1\n0 1\n0 1\n",
)
XML = """<?xml version="1.0"?><VTKFile type="PolyData" version="1.0" byte_order="LittleEndian">\
<PolyData><FieldData><DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">\
1.5</DataArray></FieldData><Piece NumberOfPoints="2"><Points><DataArray type="Float32" \
NumberOfComponents="3" format="ascii">0 1 2 3 4 5</DataArray></Points><PointData>\
<DataArray type="Float64" Name="radius" format="ascii">.1 .2</DataArray>\
<DataArray type="Int64" Name="id" format="ascii">3 1</DataArray></PointData></Piece></PolyData>\
</VTKFile>
"""
COLLECTION = """<?xml version="1.0"?><VTKFile type="Collection"><Collection>\
<DataSet timestep="0.5" part="0" file="a_10.vtp"/><DataSet timestep="1" file="a_20.vtk"/>\
</Collection></VTKFile>
"""


def encoded(**files: str) -> dict[str, bytes]:
    return {name.replace("__", "."): text.encode() for name, text in files.items()}


def yade() -> dict[str, bytes]:
    """The first rows of YADE's own files."""
    found = sorted((ROOT / "tests/data/yade").glob("*.txt"))
    return {one.name: b"".join(one.read_bytes().splitlines(True)[:5]) for one in found}


# By reader.
TEXTS: dict[str, dict[str, bytes]] = {
    "csv": encoded(edem__csv=EDEM, times__csv=TIMES, german__csv=GERMAN),
    "local_dump": encoded(
        a__local=instant(
            7, "c_q[1] c_q[2] c_p[1] c_p[2] c_p[3] c_p[4] x y z", PAIRS, BOX, "ENTRIES"
        ),
        b__local=instant(7, "id1 id2 dist fx fy fz px py pz", PAIRS, TILTED, "ENTRIES"),
    ),
    "mercury_data": encoded(run__data=DATA, plane__data=PLANE),
    "mercury_fstat": encoded(run__fstat=FSTAT),
    "points_csv": encoded(points7__csv=POINTS),
    "points_dump": encoded(points__7__txt=KARAMELO),
    "points_vtk": encoded(slope_MPScalar_003__vtk=ANURA),
    "text_dump": encoded(
        a__dump=instant(10, "id type x y z radius", GRAINS)
        + instant(20, "id type x y z radius", []),
        b__dump="ITEM: UNITS\nsi\nITEM: TIME\n0.5\n"
        + instant(10, "id type xs ys zs diameter", GRAINS, TILTED),
        c__dump=instant(10, "id ix xu yu zu element", ["1 0 .1 .2 .3 Fe", "2 1 1e-3 2 3 Al"]),
    ),
    "vtk_grains": encoded(a_20__vtk=LEGACY, a_10__vtp=XML, all__pvd=COLLECTION),
    "yade": yade(),
}

CASE = b"""title = "Synthetic block"
[geometry]
dimension = "plane_strain"
height = 0.04
length = 0.04
thickness = 0.008
floor_length = 0.2
gravity = 9.81
[grains]
diameter = 0.002
density = 2500.0
[initial]
void_ratio = 0.7
[walls]
front_back = "periodic"
[compare]
width = 0.75
spacing = 1.0
"""
CARD = b"""[material]
law = "external"
library = "libmine.so"
interface = "umat"
constants = [1e6, 0.3]
state_variables = 2
parameters_file = "mine.toml"
[grains]
diameter = 1e-3
"""
PACKINGS = b"""# command: python3 -m compare.study.packings cases/column_small --seeds 3
# made of: {"dem.audit_interval": 20, "dem.coarsening": 1.0}
# units: run_out [L0]
seed,centre_of_mass_x,run_out,final_height
1,0.5,1.5,0.25
2,0.6,1.25,0.3
3,0.55,1.75,0.2
"""


def reference(made_of: dict) -> bytes:
    """Two members of a reference of the grains, with a tenth of the instants and few cells."""
    found = json.loads((ROOT / "cases/column_ci/reference/grains.json").read_text())
    few = [
        {
            name: one[::10] if isinstance(one, list) and name != "x" else one
            for name, one in member.items()
        }
        for member in found["members"][:2]
    ]
    for member in few:
        gone = member["dissipation"]
        gone |= {name: gone[name][:12] for name in ("behind", "share")}
    return json.dumps({"made_of": made_of, "members": few, "seeds": [1, 2]}).encode()


def npz() -> dict[str, bytes]:
    plain, packed = io.BytesIO(), io.BytesIO()
    arrays = {"x": np.arange(6.0).reshape(2, 3), "v": np.ones((2, 3)), "mass": np.ones(2)}
    np.savez(plain, **arrays)
    np.savez_compressed(packed, **arrays, step=np.int64(4))
    return {"points7.npz": plain.getvalue(), "points8.npz": packed.getvalue()}


def vtk_bytes() -> dict[str, bytes]:
    """Legacy VTK with bytes, and XML with arrays behind the tree, packed."""
    legacy = b"# vtk DataFile Version 3.0\nx\nBINARY\nDATASET POLYDATA\nPOINTS 2 float\n"
    legacy += pack(">6f", *range(6)) + b"\nPOINT_DATA 2\nSCALARS radius double 1\n"
    legacy += b"LOOKUP_TABLE default\n" + pack(">2d", 0.1, 0.2) + b"\n"
    return {
        "bytes_3.vtk": legacy,
        "raw_3.vtp": appended(raw=True),
        "base64_3.vtp": appended(raw=False),
    }


def appended(raw: bool) -> bytes:
    data, offsets = b"", []
    for one in (pack("<6f", *range(6)), pack("<2q", 3, 1)):
        offsets.append(len(data))
        piece = zlib.compress(one)
        head = pack("<4Q", 1, len(one), len(one), len(piece))
        data += head + piece if raw else b64encode(head) + b64encode(piece)
    code = "raw" if raw else "base64"
    tree = (
        '<?xml version="1.0"?><VTKFile type="PolyData" version="1.0" header_type="UInt64" '
        'byte_order="LittleEndian" compressor="vtkZLibDataCompressor"><PolyData>'
        '<Piece NumberOfPoints="2"><Points><DataArray type="Float32" NumberOfComponents="3" '
        f'format="appended" offset="{offsets[0]}"/></Points><PointData><DataArray type="Int64" '
        f'Name="id" format="appended" offset="{offsets[1]}"/></PointData></Piece></PolyData>'
        f'<AppendedData encoding="{code}">\n_'
    )
    return tree.encode() + data + b"\n</AppendedData></VTKFile>\n"


def written(fill) -> bytes:
    memory = io.BytesIO()
    with h5py.File(memory, "w") as file:
        fill(file)
    return memory.getvalue()


def cb_geo() -> dict[str, bytes]:
    names = [f"{what}_{axis}" for what in ("coord", "velocity") for axis in "xyz"]
    names += ["stress_xx", "stress_yy", "stress_zz", "tau_xy", "tau_yz", "tau_xz", "mass", "volume"]

    def table(file):
        rows = np.zeros(2, [("id", "u8"), *((name, "f8") for name in names), ("status", "?")])
        rows["id"], rows["status"], rows["mass"] = (0, 1), True, 1.0
        file["table"] = rows

    def columns(file):
        for name in names:
            file[name] = np.array([0.5, 1.5])

    return {"particles7.h5": written(table), "columns7.h5": written(columns)}


def cloud(file, engine: str):
    """Two points, in two frames or, of grains, in one, in the layout of CONTRIBUTING.md; the first
    of two holds what must be there alone, as every column takes its time.
    """
    file.attrs.update({"openPMD": "1.1.0", "engine": engine, "schema_version": 1, "seed": 1})
    for step in (5,) if engine == "dem" else (0, 5):
        frame = file.create_group(f"data/{step}")
        frame.attrs["time"] = 0.1 * step
        for record in ("position", "velocity", *(["angular_velocity"] * (engine == "dem"))):
            for axis in "xyz":
                frame[f"particles/cloud/{record}/{axis}"] = np.array([0.001, 0.003])
        scalars = ["mass"]
        if step:
            scalars += ["id", "solid_volume"]
            scalars += {"dem": ["radius", "kind"], "mpm": ["void_ratio", "granular_temperature"]}[
                engine
            ]
        for name in scalars:
            frame[f"particles/cloud/{name}"] = np.array([1.0, 2.0])
        if not step:
            continue
        if engine == "mpm":
            for part in ("xx", "yy", "zz", "xy", "yz", "zx"):
                frame[f"particles/cloud/stress/{part}"] = np.array([10.0, 20.0])
            continue
        frame["contacts/first"], frame["contacts/second"] = np.array([1, 2]), np.array([2, -3])
        for record in ("branch", "position", "force"):
            for axis in "xyz":
                frame[f"contacts/{record}/{axis}"] = np.array([1e-3, 2e-3])


@cache
def grains() -> dict[str, bytes]:
    return {f"{name}.h5": written(lambda file, n=name: cloud(file, n)) for name in ("mpm", "dem")}


@cache
def runs() -> dict[str, bytes]:
    def fill(file, engine):
        cloud(file, engine)
        file.attrs.update({"case": "x", "case_resolved": CASE.decode(), "command": "x"})
        file.attrs.update({"time_scale": 0.06, "cpu_seconds": 1.0, "wall_seconds": 1.0})
        for name in ("time", "kinetic", "potential", "dissipated", "dissipated_regime_4"):
            file[f"energy/{name}"] = np.array([0.0, 0.1, 0.2])

    return {f"{name}.h5": written(lambda file, n=name: fill(file, n)) for name in ("mpm", "dem")}
