"""Other programs' axes, origins and units: turned, taken or asked for, never guessed silently."""

import itertools

import h5py
import numpy as np
import pytest
from foreign_block import BOX, DT, RHO, SCENE, D, W, grains, imported, write

from cases.errors import CaseError
from compare.importing import axes, lattice, units
from compare.importing.frame import Box
from compare.mapping.runs import open_run
from compare.metrics.run_out import run_out


def z_up(step, columns):
    """x along the flow, z up: y is minus our z, so that the axes stay right-handed."""
    return columns | {
        "y": W - columns["z"],
        "z": columns["y"],
        "vy": -columns["vz"],
        "vz": columns["vy"],
    }


BOX_Z = ("mm pp mm", [BOX[1][0], BOX[1][2], BOX[1][1]])
OPEN = "mm mm mm"


def position(path, step=0):
    with h5py.File(path) as file:
        group = file[f"data/{step}/particles/cloud"]
        return np.stack([group["position"][k][:] for k in "xyz"], axis=1)


def test_z_up_is_seen_and_turned_when_told(tmp_path):
    file = write(tmp_path / "a.dump", z_up, box=BOX_Z)
    with pytest.raises(CaseError, match=r"a.dump\S*: y is not up .* give --up z"):
        imported(tmp_path, file)
    path, _ = imported(tmp_path, file, up="z")
    assert run_out(open_run(path)) == pytest.approx(0.9, abs=1e-12)
    true = grains(0.0)
    # The box repeats from y = 0 to W, so across = -y is shifted to run from 0 to W as well.
    assert position(path) == pytest.approx(np.stack([true[k] for k in "xyz"], 1), abs=1e-12)


def test_what_tells_that_y_is_not_up(tmp_path):
    """Each of the signs by itself: floor, extents, energy; and none of them in the right file."""
    box = (OPEN, BOX_Z[1])
    with pytest.raises(CaseError, match="never move lie below the others along z"):
        imported(tmp_path, write(tmp_path / "a.dump", z_up, box=box), scene=None, density=RHO)

    def without_floor(step, columns):
        return {name: values[:300] for name, values in z_up(step, columns).items()}

    file = write(tmp_path / "a.dump", without_floor, box=box)
    with pytest.raises(CaseError, match="the column would be 20, 6, 20 mm large"):
        imported(tmp_path, file)

    def rising(step, columns):
        turned = without_floor(step, columns)
        return turned | {"y": turned["y"] + 1e-6 * step}

    file = write(tmp_path / "a.dump", rising, box=box)
    with pytest.raises(CaseError, match="would gain potential energy.* give --up z"):
        imported(tmp_path, file, scene=None, density=RHO)
    path, notes = imported(tmp_path, file, scene=None, density=RHO, up="y")
    assert any(note.startswith("implausible: the grains gain") for note in notes)
    imported(tmp_path, write(tmp_path / "a.dump"), scene=None, density=RHO)  # y is up there


def test_the_only_axis_that_does_not_repeat_is_up(tmp_path):
    box = ("pp pp ff", BOX_Z[1])
    path, notes = imported(
        tmp_path, write(tmp_path / "a.dump", z_up, box=box), scene=None, density=RHO
    )
    assert "assumed: z is up (the only axis that is not periodic)" in notes
    with h5py.File(path) as file:
        assert file.attrs["gravity"] == pytest.approx([0.0, -9.81, 0.0])
        assert list(file.attrs["periodic"]) == [1, 0, 1]
        frame = file["data/0"].attrs
        assert frame["box_lower"] == pytest.approx([-0.002, -0.01, -W])
        assert frame["box_upper"] == pytest.approx([0.3, 0.1, 0.0])
    assert position(path)[:, 2] == pytest.approx(grains(0.0)["z"] - W)


def test_gravity_tells_up(tmp_path):
    file = write(tmp_path / "a.dump", z_up, box=(OPEN, BOX_Z[1]))
    path, _ = imported(tmp_path, file, gravity=(1.0, 0.0, -9.0), scene=None, density=RHO)
    with h5py.File(path) as f:
        assert f.attrs["gravity"] == pytest.approx([1.0, -9.0, 0.0])


def test_grains_that_run_backwards(tmp_path):
    def mirrored(step, columns):  # by half a turn about y
        return columns | {k: -columns[k] for k in ("x", "z", "vx", "vz")}

    box = (BOX[0], [(-0.3, 0.002), (-0.01, 0.1), (-W, 0.0)])
    file = write(tmp_path / "a.dump", mirrored, box=box)
    with pytest.raises(CaseError, match="run along -x .* give --flow -x"):
        imported(tmp_path, file)
    path, _ = imported(tmp_path, file, flow="-x")
    assert run_out(open_run(path)) == pytest.approx(0.9, abs=1e-12)
    true = grains(0.0)
    assert position(path) == pytest.approx(np.stack([true[k] for k in "xyz"], 1), abs=1e-12)

    def elsewhere(step, columns):
        moved = mirrored(step, columns)
        return moved | {"x": moved["x"] + 0.01}

    box = ("mf mm pp", [(-0.3, 0.01), *box[1][1:]])  # the face above is our wall below
    path, _ = imported(tmp_path, write(tmp_path / "a.dump", elsewhere, box=box), flow="-x")
    assert position(path) == pytest.approx(np.stack([true[k] for k in "xyz"], 1), abs=1e-12)


@pytest.mark.parametrize(
    ("up", "flow"),
    [(u, f) for u, f in itertools.product(axes.WORDS, axes.WORDS) if u[-1] != f[-1]],
)
def test_every_turn_is_proper(up, flow):
    turn = axes.Axes.of(up, flow).turn
    assert np.linalg.det(turn) == pytest.approx(1.0) and np.array_equal(turn @ turn.T, np.eye(3))
    assert np.array_equal(turn @ axes.direction(up), [0, 1, 0])
    assert np.array_equal(turn @ axes.direction(flow), [1, 0, 0])
    # A spin turns with the velocities it makes: v = omega x r.
    omega, r = np.array([1.0, 2.0, 3.0]), np.array([0.3, -0.2, 0.5])
    assert np.cross(turn @ omega, turn @ r) == pytest.approx(turn @ np.cross(omega, r))


def test_spins_turn_with_the_grains(tmp_path):
    def spinning(step, columns):
        spin = {f"omega{k}": np.full(360, value) for k, value in zip("xyz", (1.0, 2.0, 3.0))}
        return z_up(step, columns) | spin

    names = "id type x y z vx vy vz radius omegax omegay omegaz"
    file = write(tmp_path / "a.dump", spinning, box=BOX_Z, names=names)
    path, _ = imported(tmp_path, file, up="z")
    with h5py.File(path) as f:
        spin = [f[f"data/0/particles/cloud/angular_velocity/{k}"][0] for k in "xyz"]
        rotational = f["energy/rotational"][0]
    assert spin == [1.0, 3.0, -2.0]
    mass = 300 * RHO * np.pi / 6 * D**3
    assert rotational == pytest.approx(0.2 * mass * (D / 2) ** 2 * 14.0)


def moved_by(dx, dz=0.0):
    return lambda step, columns: columns | {"x": columns["x"] + dx, "z": columns["z"] + dz}


def test_a_wall_elsewhere_is_taken_from_the_box_or_asked_for(tmp_path):
    corners = [(-0.01, 0.3), (-0.01, 0.1), (-0.003, 0.003)]
    shifted = moved_by(-0.01, -0.003)
    file = write(tmp_path / "a.dump", shifted, box=("mm mm pp", corners))
    with pytest.raises(CaseError, match="left wall at 0 .* give --origin -0.01 0 -0.003"):
        imported(tmp_path, file)
    true = np.stack([grains(0.0)[k] for k in "xyz"], 1)
    path, _ = imported(tmp_path, file, origin=(-0.01, 0.0, -0.003))
    assert position(path) == pytest.approx(true, abs=1e-12)
    file = write(tmp_path / "a.dump", shifted, box=("fm mm pp", corners))
    path, notes = imported(tmp_path, file)
    assert position(path) == pytest.approx(true, abs=1e-12)
    assert run_out(open_run(path)) == pytest.approx(0.9, abs=1e-12)
    assert "shifted: left wall from -0.01 m to 0, where the box has it" in notes
    # A fixed face that no grain touches is no wall of theirs.
    far = [(-0.012, 0.3), *corners[1:]]
    with pytest.raises(CaseError, match="give --origin"):
        imported(tmp_path, write(tmp_path / "a.dump", shifted, box=("fm mm pp", far)))


def test_a_floor_elsewhere_is_where_the_glued_grains_are(tmp_path):
    def raised(step, columns):
        return columns | {"y": columns["y"] + 0.05}

    box = (BOX[0], [BOX[1][0], (0.0, 0.2), BOX[1][2]])
    path, notes = imported(tmp_path, write(tmp_path / "a.dump", raised, box=box))
    assert any(note.startswith("shifted: floor from 0.05 m to 0") for note in notes)
    assert position(path)[:, 1] == pytest.approx(grains(0.0)["y"], abs=1e-12)


def test_units_are_turned_into_si(tmp_path):
    def cgs(step, columns):
        lengths = ("x", "y", "z", "vx", "vy", "vz", "radius")
        return columns | {k: 100.0 * columns[k] for k in lengths} | {"density": np.full(360, 1.5)}

    corners = [(100 * a, 100 * b) for a, b in BOX[1]]
    more = {"names": "id x y z vx vy vz radius density", "box": (BOX[0], corners)}
    file = write(tmp_path / "a.dump", cgs, **more)
    path, notes = imported(tmp_path, file, units="cgs")
    run = open_run(path)
    assert run.mass == pytest.approx(300 * 1500.0 * np.pi / 6 * D**3)
    assert run_out(run) == pytest.approx(0.9, abs=1e-12)
    with h5py.File(path) as f:
        assert f["data/0"].attrs["box_upper"] == pytest.approx([0.3, 0.1, W])
    told = write(tmp_path / "a.dump", cgs, head="ITEM: UNITS\ncgs\n", **more)
    assert open_run(imported(tmp_path, told)[0]).mass == pytest.approx(run.mass)
    with pytest.raises(CaseError, match="UNITS is cgs .--units says si"):
        imported(tmp_path, told, units="si")
    # Without a word they are SI, and that makes another scene of it.
    with pytest.raises(CaseError, match="other units"):
        imported(tmp_path, write(tmp_path / "a.dump", cgs, **more))


@pytest.mark.parametrize("name", units.OF_ATOMS)
def test_units_of_atoms_are_refused_by_name(tmp_path, name):
    file = write(tmp_path / "a.dump", head=f"ITEM: UNITS\n{name}\n")
    with pytest.raises(CaseError, match=rf"a.dump\S*: UNITS is {name} .units of atoms"):
        imported(tmp_path, file)


def test_units_lj_need_their_scales(tmp_path):
    file = write(tmp_path / "a.dump", head="ITEM: UNITS\nlj\n")
    with pytest.raises(CaseError, match="give --lj-length, --lj-mass and --lj-time"):
        imported(tmp_path, file)
    with pytest.raises(CaseError, match="of units lj only"):
        imported(tmp_path, write(tmp_path / "b.dump"), scales=(1.0, 1.0, 1.0))


def test_every_unit_derives_from_three():
    one = units.Units("made up", 2.0, 3.0, 5.0)
    told = {"x": 2.0, "vx": 0.4, "omegax": 0.2, "mass": 3.0, "density": 3 / 8, "fx": 6 / 25}
    told |= {"sxx": 3 / 2 / 25, "power": 12 / 125, "volume": 8.0, "temperature": 4 / 25, "id": 1.0}
    assert {name: one.factor(name) for name in told} == pytest.approx(told)


def test_times_of_the_file_are_its_units(tmp_path):
    def timed(step, columns):
        return columns

    path = tmp_path / "a.dump"
    frames = [
        write(tmp_path / f"{step}", timed, steps=[step], head=f"ITEM: TIME\n{DT * step}\n")
        for step in (0, 2000, 5000)
    ]
    path.write_text("".join(file.read_text() for file in frames))
    found, notes = imported(tmp_path, path, time_step=None)
    assert open_run(found).time == pytest.approx([0.0, 0.02, 0.05])
    _, notes = imported(tmp_path, path, time_step=2e-5)
    assert any(note.startswith("disagrees: time step 1e-05 s") for note in notes)


def test_images_of_a_tilted_box():
    box = Box(
        np.zeros(3),
        np.array([1.0, 2.0, 4.0]),
        np.array([True, True, False]),
        np.zeros((3, 2), bool),
        np.array([0.25, 0.0, 0.0]),
    )
    b = np.array([0.25, 2.0, 0.0])
    branch = np.array([[0.1, 0.1, 3.0]])
    assert lattice.nearest(branch + b, box) == pytest.approx(branch)
    places = np.array([[0.5, 1.0, 1.0]])
    assert lattice.wrapped(places - 2 * b + [3.0, 0, 0], box) == pytest.approx(places)
    turned = axes.Axes.of("z", "x").box(box)
    assert list(turned.periodic) == [True, False, False]  # along y it repeats with a shift


def test_the_case_is_none_of_theirs():
    """The size that the block has is the case's; else the tests above would show nothing."""
    first, seen = grains(0.0), SCENE["geometry"]
    assert np.ptp(first["x"][:300]) + D == pytest.approx(seen["length"])
    assert np.ptp(first["z"]) + D == pytest.approx(seen["thickness"])
