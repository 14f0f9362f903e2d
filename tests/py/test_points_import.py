"""Material points of other MPM codes: their files, and the run file that becomes of them."""

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import synthetic
from cases.errors import CaseError
from compare.importing import points_file, registry
from compare.importing.frame import VECTORS, Frame
from compare.importing.points_file import PointOptions
from compare.mapping.runs import map_fields, open_run
from compare.metrics import kinetic_energy_peak, mass, run_out, unaccounted_energy
from compare.report import report
from compare.verdict import comparison, conclusion
from mutations import mutated, read_or_refused

COUNT = 5
PLACE = np.random.default_rng(4).random((COUNT, 3))
SPEED = np.random.default_rng(5).random((COUNT, 3)) - 0.5
MASS = np.arange(1.0, COUNT + 1.0)
VOLUME = MASS / 1500.0
# compression positive, symmetric
STRESS = np.random.default_rng(6).random((COUNT, 6)) * 100.0 + 50.0
FULL = STRESS[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(COUNT, 3, 3)


def cb_geo(path, status=None):
    """The table of include/hdf5_particle.h, tension positive."""
    fields = {f"coord_{axis}": PLACE[:, k] for k, axis in enumerate("xyz")}
    fields |= {f"velocity_{axis}": SPEED[:, k] for k, axis in enumerate("xyz")}
    names = ("stress_xx", "stress_yy", "stress_zz", "tau_xy", "tau_yz", "tau_xz")
    fields |= {name: -STRESS[:, k] for k, name in enumerate(names)}
    fields |= {"mass": MASS, "volume": VOLUME, "strain_xx": np.zeros(COUNT)}
    types = [("id", "u8"), *((name, "f8") for name in fields), ("status", "?")]
    table = np.zeros(COUNT, dtype=types)
    table["id"], table["status"] = np.arange(COUNT), True if status is None else status
    for name, values in fields.items():
        table[name] = values
    with h5py.File(path, "w") as file:
        file["table"] = table


def karamelo(path):
    """DumpParticle::write: the step is always 0, id and tag are the same."""
    columns = [PLACE, SPEED, STRESS[:, [0, 1, 2, 3, 5, 4]], VOLUME, MASS]
    numbers = enumerate(np.column_stack(columns).tolist())
    rows = [" ".join(map(repr, [k, 1, k, *row])) for k, row in numbers]
    path.write_text(
        f"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n{COUNT}\n"
        "ITEM: BOX BOUNDS sm sm sm\n0 1\n0 1\n0 1\n"
        "ITEM: ATOMS id type tag x y z vx vy vz s11 s22 s33 s12 s13 s23 volume mass \n"
        + "\n".join(rows)
        + "\n"
    )


def anura3d(folder, step):
    """The three files of WriteVTKOutput.FOR, tension positive."""
    head = "# vtk DataFile Version 3.0\nslope\nASCII\nDATASET UNSTRUCTURED_GRID\n"
    head += f"POINTS {COUNT} float\n" + "\n".join(" ".join(map(repr, p)) for p in PLACE.tolist())
    head += f"\nCELLS {COUNT} {2 * COUNT}\n" + "".join(f"1 {k}\n" for k in range(COUNT))
    head += f"CELL_TYPES {COUNT}\n" + "1\n" * COUNT + f"POINT_DATA {COUNT}\n"

    def scalars(name, values):
        lines = "\n".join(map(repr, values.tolist()))
        return f"SCALARS {name} float 1\nLOOKUP_TABLE default\n{lines}\n"

    def rows(values):
        return "\n".join(" ".join(map(repr, row)) for row in values.tolist()) + "\n"

    scalar = scalars("mass_solid", MASS) + scalars("integration_weight", VOLUME)
    scalar += scalars("porosity", np.full(COUNT, 0.4))
    scalar += scalars("material_point_id", np.arange(11, 11 + COUNT))
    vector = "VECTORS velocity_solid float\n" + rows(SPEED)
    tensor = "TENSORS total_stress_solid float\n" + rows(-FULL.reshape(-1, 3))
    paths = []
    for kind, text in (("Scalar", scalar), ("Vector", vector), ("Tensor", tensor)):
        paths.append(folder / f"slope_MP{kind}_{step:03d}.vtk")
        paths[-1].write_text(head + text)
    return paths


def written(tmp_path, paths, **options):
    """The run file of files, opened by h5py."""
    out = tmp_path / "points.h5"
    points_file.convert(paths, PointOptions(**options), out)
    return h5py.File(out)


def cloud_of(file, step):
    cloud = file[f"data/{step}/particles/cloud"]
    vectors = {
        name: np.stack([cloud[name][part][:] for part in parts], axis=1)
        for name, parts in {
            "position": "xyz",
            "velocity": "xyz",
            "stress": ("xx", "yy", "zz", "xy", "yz", "zx"),
        }.items()
        if name in cloud
    }
    return cloud, vectors


def check(file, step, ids, exact=1e-15):
    cloud, vectors = cloud_of(file, step)
    np.testing.assert_array_equal(cloud["id"][:], ids)
    np.testing.assert_allclose(vectors["position"], PLACE, rtol=exact)
    np.testing.assert_allclose(vectors["velocity"], SPEED, rtol=exact)
    np.testing.assert_allclose(vectors["stress"], STRESS, rtol=exact)
    np.testing.assert_allclose(cloud["mass"][:], MASS, rtol=exact)
    assert "granular_temperature" not in cloud and "regime" not in cloud
    return cloud


def test_cb_geo(tmp_path):
    cb_geo(tmp_path / "particles0100.h5")
    file = written(tmp_path, [tmp_path / "particles0100.h5"], time_step=1e-3)
    cloud = check(file, 100, np.arange(COUNT))
    assert file["data/100"].attrs["time"] == pytest.approx(0.1, rel=1e-15)
    assert "solid_volume" not in cloud and "void_ratio" not in cloud  # nobody told
    assert set(file["energy"]) == {"time", "kinetic", "potential"}
    kinetic = 0.5 * np.sum(MASS * np.sum(SPEED**2, axis=1))
    assert file["energy/kinetic"][0] == pytest.approx(kinetic, rel=1e-14)
    assert file["energy/potential"][0] == pytest.approx(
        9.81 * np.sum(MASS * PLACE[:, 1]), rel=1e-14
    )


def test_the_solids_density_tells_the_solid_volume(tmp_path):
    cb_geo(tmp_path / "particles0100.h5")
    file = written(tmp_path, [tmp_path / "particles0100.h5"], time_step=1e-3, density=2500.0)
    cloud = check(file, 100, np.arange(COUNT))
    np.testing.assert_allclose(cloud["solid_volume"][:], MASS / 2500.0, rtol=1e-15)
    np.testing.assert_allclose(cloud["void_ratio"][:], 2500.0 / 1500.0 - 1.0, rtol=1e-14)


def test_points_outside_the_mesh(tmp_path):
    path = tmp_path / "particles0100.h5"
    cb_geo(path, status=[True, True, False, True, True])
    notes: list[str] = []
    (frame,) = registry.readers()["cb_geo"].frames(path, {"notes": notes})
    assert frame.columns["id"].tolist() == [0, 1, 3, 4] and "1 points outside" in notes[0]


def test_karamelo_must_be_told_the_sign(tmp_path):
    paths = [tmp_path / "dump.0.txt", tmp_path / "dump.400.txt"]
    for path in paths:
        karamelo(path)
    with pytest.raises(CaseError, match="--tension-positive or --compression-positive"):
        written(tmp_path, paths, time_step=1e-3)
    assert not (tmp_path / "points.h5").exists()
    file = written(tmp_path, paths, time_step=1e-3, tension=False)
    check(file, 0, np.arange(COUNT))
    check(file, 400, np.arange(COUNT))


def test_the_sign_of_stress(tmp_path):
    path = tmp_path / "dump.0.txt"
    karamelo(path)
    file = written(tmp_path, [path], time_step=1e-3, tension=True)
    np.testing.assert_array_equal(cloud_of(file, 0)[1]["stress"], -STRESS)


def test_anura3ds_three_files_are_one_step(tmp_path):
    paths = anura3d(tmp_path, 3) + anura3d(tmp_path, 12)
    file = written(tmp_path, paths[::-1], time_step=0.5)
    assert sorted(file["data"]) == ["12", "3"]
    cloud = check(file, 12, np.arange(11, 11 + COUNT))
    np.testing.assert_allclose(cloud["void_ratio"][:], 0.4 / 0.6, rtol=1e-14)
    np.testing.assert_allclose(cloud["solid_volume"][:], 0.6 * VOLUME, rtol=1e-14)


def test_parts_of_other_points_are_refused(tmp_path):
    paths = anura3d(tmp_path, 3)
    text = paths[1].read_text()
    first = " ".join(map(repr, PLACE[0].tolist()))
    paths[1].write_text(text.replace(first, "7 7 7"))
    with pytest.raises(CaseError, match="step 3 again, with other points"):
        written(tmp_path, paths, time_step=0.5)


@pytest.mark.parametrize("shape", ["full", "six"])
def test_npz(tmp_path, shape):
    path = tmp_path / "MPMParticle000007.npz"
    stress = FULL if shape == "full" else STRESS
    names = {"position": PLACE, "velocity": SPEED, "mass": MASS, "volume": VOLUME, "stress": stress}
    pickled = np.array({"needs": "pickle"}, dtype=object)
    np.savez(path, t_current=0.25, state_vars=pickled, particleID=range(COUNT), **names)
    file = written(tmp_path, [path], tension=False)
    check(file, 7, np.arange(COUNT))
    assert file["data/7"].attrs["time"] == 0.25


def test_plane_arrays(tmp_path):
    path = tmp_path / "frame3.npz"
    np.savez(path, x=PLACE[:, :2], v=SPEED[:, :2], mass=MASS, stress=FULL[:, :2, :2])
    notes: list[str] = []
    file = written(tmp_path, [path], time_step=1.0, tension=False, notes=notes)
    cloud, vectors = cloud_of(file, 3)
    assert not vectors["position"][:, 2].any() and "stress" not in cloud
    assert notes == ["stress left out: no component szz"]


def test_csv(tmp_path):
    path = tmp_path / "points.csv"
    names = ["id", "x", "y", "z", "vx", "vy", "vz", "mass", *VECTORS["stress"]]
    table = np.column_stack([np.arange(COUNT), PLACE, SPEED, MASS, STRESS])
    rows = "\n".join("0.5," + ",".join(map(repr, row)) for row in table.tolist())
    path.write_text("time," + ",".join(names) + "\n" + rows.replace(",0.0,", ",0,") + "\n")
    file = written(tmp_path, [path], tension=False)
    check(file, 0, np.arange(COUNT))


@pytest.mark.parametrize("columns", [STRESS, FULL.reshape(COUNT, 9)])
def test_stress_by_numbers_of_components(tmp_path, columns):
    """As ParaView exports VTK's six components, or all nine."""
    path = tmp_path / "points.7.csv"
    names = ["ID", *(f"{name}:{k}" for name in ("Points", "Velocity") for k in range(3)), "Mass"]
    names += [f"Stress:{k}" for k in range(columns.shape[1])]
    table = np.column_stack([np.arange(COUNT), PLACE, SPEED, MASS, columns]).tolist()
    rows = [",".join(map(repr, [int(row[0]), *row[1:]])) for row in table]
    path.write_text("\n".join([",".join(f'"{name}"' for name in names), *rows]) + "\n")
    check(written(tmp_path, [path], tension=False, time_step=1.0), 7, np.arange(COUNT))


def frame(**columns):
    vectors = {name: PLACE[:, k] for k, name in enumerate(VECTORS["position"])}
    vectors |= {name: SPEED[:, k] for k, name in enumerate(VECTORS["velocity"])}
    out = {"id": np.arange(COUNT), "mass": MASS} | vectors | columns
    return Frame("here", {k: v for k, v in out.items() if v is not None}, step=1, time=0.5)


@pytest.mark.parametrize(
    "columns, what",
    [
        ({"vx": None}, "here: no velocity (lacks vx)"),
        ({"mass": None}, "here: no masses"),
        ({"mass": MASS - 1.0}, "here: mass 0.0 of point 0"),
        ({"x": np.where(MASS == 3.0, np.nan, 1.0)}, "here: position [nan"),
        ({"id": np.array([0, 1, 2, 3, 3])}, "here: id 3 more than once"),
        ({"temperature": -MASS}, "here: granular_temperature -1.0 of point 0"),
    ],
)
def test_refused(tmp_path, columns, what):
    with pytest.raises(CaseError) as error:
        points_file.write_points([frame(**columns)], PointOptions(), tmp_path / "points.h5")
    assert what in str(error.value) and not (tmp_path / "points.h5").exists()


def test_frames_out_of_order(tmp_path):
    later = frame()
    later.step, later.time = 2, 0.25
    with pytest.raises(CaseError, match="is not after that of the frame before"):
        points_file.write_points([frame(), later], PointOptions(), tmp_path / "points.h5")


def test_points_that_rise(tmp_path):
    """z is up, and y grows while z falls: refused, unless y is said to be up."""
    later = frame(y=PLACE[:, 1] + 1.0, z=PLACE[:, 2] - 1.0)
    later.step, later.time = 2, 1.0
    out = tmp_path / "points.h5"
    still = {f"v{axis}": np.zeros(COUNT) for axis in "xyz"}
    with pytest.raises(CaseError, match="y is not up .* --up z"):
        points_file.write_points([frame(**still), later], PointOptions(), out)
    points_file.write_points([frame(**still), later], PointOptions(up_told=True), out)


def test_a_format_of_grains_is_refused(tmp_path):
    with pytest.raises(CaseError, match="--format csv: not a format of points"):
        points_file.convert([tmp_path / "x"], PointOptions(), tmp_path / "out.h5", "csv")


def test_axes_turn_vectors_and_stress(tmp_path):
    """z up in the file: ours are x, z, -y, a proper rotation; work of stress and gravity stay."""
    turn = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    stress = {name: STRESS[:, k] for k, name in enumerate(VECTORS["stress"])}
    options = PointOptions(tension=False, turn=turn, origin=np.array([0.0, 0.0, 0.1]))
    points_file.write_points([frame(**stress)], options, tmp_path / "points.h5")
    with h5py.File(tmp_path / "points.h5") as file:
        vectors = cloud_of(file, 1)[1]
        np.testing.assert_allclose(vectors["position"][:, 1], PLACE[:, 2] - 0.1, rtol=1e-14)
        np.testing.assert_array_equal(vectors["velocity"][:, 2], -SPEED[:, 1])
        np.testing.assert_array_equal(vectors["stress"][:, :3], STRESS[:, [0, 2, 1]])
        # xy is the file's xz, yz the file's -zy, zx the file's -yx
        np.testing.assert_array_equal(vectors["stress"][:, 3:], STRESS[:, [5, 4, 3]] * [1, -1, -1])


OURS = {
    "granular_temperature": {"temperature": "granular_temperature"},
    "stress": {f"s{part}": f"stress/{part}" for part in ("xx", "yy", "zz", "xy", "yz", "zx")}
    | {"void_ratio": "void_ratio"},
}


def again(run, path, told=""):
    """Positions, velocities and masses of a run of ours, imported as those of another program; and
    what of its state is `told`.
    """
    frames = []
    state = OURS.get(told, {})
    for step, (time, cloud) in enumerate(zip(run.time, run.clouds)):
        columns = {name: cloud.x[:, k] for k, name in enumerate(VECTORS["position"])}
        columns |= {name: cloud.v[:, k] for k, name in enumerate(VECTORS["velocity"])}
        columns |= {"mass": cloud.mass, "id": np.arange(len(cloud.mass))}
        if state:
            with h5py.File(run.clouds.path) as file:
                cloud = file[f"data/{run.clouds.steps[step]}/particles/cloud"]
                columns |= {name: cloud[record][()] for name, record in state.items()}
        frames.append(Frame("here", columns, step, float(time), compression=True))
    points_file.write_points(frames, PointOptions(case=run.case), path)
    return open_run(path)


def test_a_run_that_comes_back(tmp_path):
    """Points of a run of ours have its figures; what they do not tell is no number."""
    run = open_run(synthetic.write_run(tmp_path / "mpm.h5", "mpm", frames=6))
    back = again(run, tmp_path / "points.h5")
    for metric in (run_out.run_out, mass.mass):
        assert metric(back) == pytest.approx(metric(run), rel=1e-12)
    assert np.isfinite(kinetic_energy_peak.kinetic_energy_peak(back))
    assert np.isnan(unaccounted_energy.unaccounted_energy(back))


@pytest.mark.parametrize("known", ["", "stress", "granular_temperature"])
def test_what_is_not_told_is_not_scored(tmp_path, known):
    """Compared with the same block of grains: figures of places agree, and those of energies,
    temperature and stress are absent where they are not known. Of our own file they are there (the
    negative control).
    """
    folder = tmp_path / "pair"
    synthetic.write_pair(folder, mpm={"frames": 6}, dem={"frames": 6, "jitter": True})
    map_fields([folder / "mpm.h5", folder / "dem.h5"], folder / "fields.h5")
    ours = conclusion.conclude(comparison.load(folder), [])
    again(open_run(folder / "mpm.h5"), tmp_path / "points.h5", known)
    (tmp_path / "points.h5").replace(folder / "mpm.h5")
    if known == "granular_temperature":  # no page again, which takes long
        map_fields([folder / "mpm.h5", folder / "dem.h5"], folder / "fields.h5")
        theirs = conclusion.conclude(comparison.load(folder), [])
    else:
        theirs = report.compare(folder)
    for name in ("run_out", "centre_of_mass_x", "final_height"):
        assert theirs[name]["mpm"] == pytest.approx(ours[name]["mpm"], rel=1e-12)
    for name in ("dissipated_energy", "unaccounted_energy"):
        assert ours[name]["mpm"] is not None and theirs[name]["mpm"] is None
    assert theirs["dissipation_distance"]["value"] is None
    for record, name, part in (
        ("granular_temperature", "granular_temperature_error", "value"),
        ("stress", "pressure_roughness", "mpm"),
    ):
        # (the block is at rest: what its temperature is off by is a quotient of round-offs)
        assert ours[name][part] is not None
        assert (theirs[name][part] is not None) == (known == record)
    told = [finding["sentence"] for finding in theirs["findings"]["list"]]
    assert any("do not tell what was dissipated" in sentence for sentence in told)


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(["karamelo", "csv"]), st.integers(0, 10**6))
def test_broken_files_are_read_or_refused(tmp_path_factory, kind, seed):
    folder = tmp_path_factory.mktemp("points")
    path = folder / "points.7.txt"
    if kind == "karamelo":
        karamelo(path)
    else:
        path.write_text("id x y z vx vy vz mass\n1 0 0 0 1 1 1 2\n2 0 1 0 1 1 1 2\n")
    path.write_bytes(mutated(path.read_bytes(), seed))
    reader = registry.readers()["points_dump" if kind == "karamelo" else "points_csv"]
    frames = read_or_refused(reader, path)
    if frames:
        try:
            points_file.write_points(frames, PointOptions(time_step=1.0), folder / "points.h5")
        except CaseError as error:
            assert "\n" not in str(error)


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(["npz", "h5"]), st.data())
def test_broken_binaries_are_read_or_refused(tmp_path_factory, kind, data):
    path = tmp_path_factory.mktemp("points") / f"points7.{kind}"
    if kind == "h5":
        cb_geo(path)
    else:
        np.savez(path, x=PLACE, v=SPEED, mass=MASS)
    raw = bytearray(path.read_bytes())
    for _ in range(3):
        raw[data.draw(st.integers(4, len(raw) - 1))] ^= data.draw(st.integers(1, 255))
    path.write_bytes(raw[: data.draw(st.integers(4, len(raw)))])
    read_or_refused(registry.readers()["cb_geo" if kind == "h5" else "points_npz"], path)
