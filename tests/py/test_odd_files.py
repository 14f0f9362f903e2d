"""Files of four grains in three frames, as other hands and programs write them: each must give what
the plain file of its kind does.
"""

from typing import Any

import h5py
import numpy as np
import pytest

from cases.errors import CaseError
from compare.importing.options import Options
from compare.importing.pipeline import convert

PLACE = np.array([[1.0, 1.0, 1.0], [3.0, 1.0, 1.0], [5.0, 1.0, 1.0], [1.0, 3.0, 1.0]]) * 1e-3
SPEED = np.array([[0.1, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, -0.1, 0.0]])
STEPS, DT, R, RHO = (0, 1000, 2000), 1e-5, 1e-3, 2500.0


def state(step: int) -> np.ndarray:
    """Rows (4, 6): places and velocities."""
    return np.hstack([PLACE + step * DT * SPEED, SPEED])


def row(*values: float, apart: str = " ") -> str:
    return apart.join(f"{value:.12g}" for value in values)


def dump(step: int, told: str | None = None) -> str:
    rows = "".join(row(k, 1, *one, R, RHO) + "\n" for k, one in enumerate(state(step), start=1))
    return (
        f"ITEM: TIMESTEP\n{step if told is None else told}\nITEM: NUMBER OF ATOMS\n4\n"
        "ITEM: BOX BOUNDS ff ff ff\n0 .05\n0 .05\n0 .05\n"
        f"ITEM: ATOMS id type x y z vx vy vz radius density\n{rows}"
    )


HEADINGS = "time,id,x,y,z,vx,vy,vz,radius,density"


def table(head: str = HEADINGS, apart: str = ",", between: str = "", end: str = "") -> str:
    frames = [
        "".join(
            row(step * DT, k, *one, R, RHO, apart=apart) + end + "\n"
            for k, one in enumerate(state(step), start=1)
        )
        for step in STEPS
    ]
    return head.replace(",", apart) + end + "\n" + between.join(frames)


def alone(step: int) -> str:
    """A table without times."""
    rows = [row(k, *one, R, RHO, apart=",") for k, one in enumerate(state(step), start=1)]
    return HEADINGS.removeprefix("time,") + "\n" + "\n".join(rows) + "\n"


def yade(step: int, between: str = "", end: str = "") -> str:
    rows = [row(*one[:3], R, *one[3:], RHO) + "\n" for one in state(step)]
    head = "#format x_y_z_r_attrs\n# x y z r vx vy vz density\n"
    return head + between.join(rows) + end


def mercury(step: int) -> str:
    rows = [row(*one, R, *[0.0] * 7) + "\n" for one in state(step)]
    return f"4 {step * DT:g} 0 0 0 .05 .05 .05\n" + "".join(rows)


def in_plane(step: int) -> str:
    """MercuryDPM in two dimensions; the third is zero."""
    rows = [row(*one[:2], *one[3:5], R, 0.5, 0.0, 0.0) + "\n" for one in state(step)]
    return f"4 {step * DT:g} 0 0 .05 .05\n" + "".join(rows)


def spheres_of_vtk(step: int) -> str:
    place, speed = state(step)[:, :3], state(step)[:, 3:]
    lines = ["# vtk DataFile Version 3.0", "grains", "ASCII", "DATASET POLYDATA", "POINTS 4 double"]
    lines += [row(*one) for one in place]
    lines += ["POINT_DATA 4", "SCALARS radius double 1", "LOOKUP_TABLE default", *4 * [row(R)]]
    lines += ["SCALARS id int 1", "LOOKUP_TABLE default", "1 2 3 4", "VECTORS v double"]
    return "\n".join([*lines, *(row(*one) for one in speed)]) + "\n"


def each(make, name: str, **words) -> dict[str, str]:
    """A file of every frame."""
    return {name.format(step): make(step, **words) for step in STEPS}


DUMPS = [dump(step) for step in STEPS]
UNITS = "\ns,-,m,m,m,m/s,m/s,m/s,m,kg/m3"
MICRO = "time [s],id,x [µm],y [µm],z [µm],vx [m/s],vy [m/s],vz [m/s],radius [m],density [kg/m3]"


def micrometres() -> bytes:
    """In the encoding of older spreadsheets."""
    lines = table(MICRO).splitlines()
    rows = [line.split(",") for line in lines[1:]]
    rows = [[*one[:2], *(f"{1e6 * float(x):.12g}" for x in one[2:5]), *one[5:]] for one in rows]
    return "\n".join([lines[0], *map(",".join, rows)]).encode("latin-1") + b"\n"


FILES: dict[str, dict] = {
    "plain dump": {"a.dump": "".join(DUMPS)},
    "dump below a comment": {"a.dump": "# made by hand\n\n" + "".join(DUMPS)},
    "comments between frames": {"a.dump": "# next\n\n".join(DUMPS)},
    "steps with an exponent": {
        "a.dump": "".join(dump(step, f"{step:.3e}" if step else "0") for step in STEPS)
    },
    "plain table": {"a.csv": table()},
    "comments in a table": {"a.csv": table(between="# next\n")},
    "headings again": {"a.csv": table(between=HEADINGS + "\n")},
    "commas at the end": {"a.csv": table(end=",")},
    "a line of units": {"a.csv": table(HEADINGS + UNITS)},
    "bars": {"a.csv": table(apart="|")},
    "old encoding": {"a.csv": micrometres()},
    "tables named by step": each(alone, "grains_{}.csv"),
    "plain spheres": each(yade, "spheres_{}.txt"),
    "spheres named with points": each(yade, "spheres.{}.txt"),
    "comments among spheres": each(yade, "spheres_{}.txt", between="# a comment\n"),
    "blank lines among spheres": each(yade, "spheres_{}.txt", between="\n", end="\n\n"),
    "plain particles": {"a.data": "".join(map(mercury, STEPS))},
}


def read_frames(path) -> list[dict[str, np.ndarray]]:
    """Time, records, and of contacts the ids of the first."""
    with h5py.File(path) as file:
        out = []
        for step in sorted(file["data"], key=int):
            group = file["data"][step]
            cloud = group["particles/cloud"]
            frame = {"time": group.attrs["time"], "radius": cloud["radius"][()]}
            for name in {"position", "velocity", "angular_velocity"} & set(cloud):
                frame[name] = np.stack([cloud[name][axis][()] for axis in "xyz"], axis=1)
            if "contacts" in group:
                frame["first"] = group["contacts/first"][()]
            out.append(frame)
        return out


def imported(folder, files: dict, **options) -> list[dict[str, np.ndarray]]:
    packed = {k: v if isinstance(v, bytes) else v.encode() for k, v in files.items()}
    for name, content in packed.items():
        (folder / name).write_bytes(content)
    timed = any(content.startswith((b"time", b"4 ")) for content in packed.values())
    told: dict[str, Any] = {"density": RHO, "up": "y"} | ({} if timed else {"time_step": DT})
    names = tuple(folder / name for name in files)
    convert(Options(names, **told | options), None, folder / "grains.h5")
    return read_frames(folder / "grains.h5")


@pytest.mark.parametrize("name", FILES)
def test_all_are_read_alike(tmp_path, name):
    frames = imported(tmp_path, FILES[name])
    assert [frame["time"] for frame in frames] == pytest.approx([step * DT for step in STEPS])
    for step, frame in zip(STEPS, frames):
        rows = np.hstack([frame["position"], frame["velocity"]])
        assert rows == pytest.approx(state(step), rel=1e-6, abs=1e-12)
        assert frame["radius"] == pytest.approx(np.full(4, R))


def test_mercury_in_two_dimensions(tmp_path):
    frames = imported(tmp_path, {"a.data": "".join(map(in_plane, STEPS))})
    for step, frame in zip(STEPS, frames):
        assert frame["position"][:, :2] == pytest.approx(state(step)[:, :2], rel=1e-6)
        assert frame["angular_velocity"] == pytest.approx(np.tile([0.0, 0.0, -0.0], (4, 1)))


def test_blank_lines_between_contacts_of_mercury(tmp_path):
    corners = "# 0 0 0 .05 .05 .05\n# .001 .001 0 0 0 0\n"
    rows = "{0:g} 0 1 .002 .001 .001 1e-6 0 5 0 -1 0 0 0 0 0\n"
    parts = [f"# {step * DT:g} 1\n{corners}{rows.format(step * DT)}" for step in STEPS]
    files = {"a.data": "".join(map(mercury, STEPS)), "a.fstat": "\n".join(parts)}
    assert [len(frame["first"]) for frame in imported(tmp_path, files)] == [1, 1, 1]


MESH = """# vtk DataFile Version 2.0
walls
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 3 float
0 0 0
1 0 0
0 1 0
CELLS 1 4
3 0 1 2
CELL_TYPES 1
5
CELL_DATA 1
SCALARS id int 1
LOOKUP_TABLE default
7
"""


def test_a_mesh_beside_the_grains(tmp_path):
    """As `dump mesh/vtk` of LIGGGHTS leaves it, of the same steps, in a folder of both."""
    files = each(spheres_of_vtk, "grains{}.vtk") | {f"walls{step}.vtk": MESH for step in STEPS}
    for name, content in files.items():
        (tmp_path / name).write_text(content)
    told = Options((tmp_path,), time_step=DT, density=RHO, up="y")
    notes = convert(told, None, tmp_path / "grains.h5")
    assert [len(frame["radius"]) for frame in read_frames(tmp_path / "grains.h5")] == [4, 4, 4]
    assert sum("(a mesh?)" in note for note in notes) == 3


def test_dumps_and_vtk_of_the_same_frames(tmp_path):
    """In one folder, with the script that made them: the dumps count, which tell the box."""
    files = each(spheres_of_vtk, "out{}.vtk") | each(dump, "out{}.dump")
    files["in.script"] = "dump one all custom 100 out*.dump id type x y z vx vy vz\nrun 100\n"
    for name, content in files.items():
        (tmp_path / name).write_text(content)
    told = Options((tmp_path,), time_step=DT, up="y")
    notes = convert(told, None, tmp_path / "grains.h5")
    with h5py.File(tmp_path / "grains.h5") as file:
        assert file["data/1000"].attrs["box_upper"] == pytest.approx([0.05] * 3)
    assert any("passed over: in.script" in note for note in notes)


def test_a_file_without_anything_in_it(tmp_path):
    files = {"a.dump": "".join(DUMPS), "b.dump": "\n"}
    with pytest.raises(CaseError) as error:
        imported(tmp_path, files)
    assert "holds nothing" in str(error.value) and str(error.value).count("--skip") == 1
    assert len(imported(tmp_path, files, skip_incomplete=True)) == 3


def test_words_in_place_of_places(tmp_path):
    words = "".join(DUMPS).replace("0.001 0.001 0.001", "1.0D-03 1.0D-03 1.0D-03")
    words = words.replace("0.001 0.003 0.001", "1.0D-03 3.0D-03 1.0D-03")
    with pytest.raises(CaseError, match="a.dump:10: x is no number"):
        imported(tmp_path, {"a.dump": words})
