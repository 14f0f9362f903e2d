"""Grains of other programs: right, or one line that says why not."""

import h5py
import numpy as np
import pytest
from foreign_block import DT, RHO, SCENE, STEPS, D, L, grains, imported, write

from cases.errors import CaseError
from compare import __main__ as cli
from compare.importing.walls import Chosen
from compare.metrics.run_out import run_out
from compare.mapping.runs import open_run
from compare.verdict.budget import budget

VOLUME = np.pi / 6 * D**3
MASS = 300 * RHO * VOLUME  # kg, of what moves


def energy(path) -> dict[str, np.ndarray]:
    with h5py.File(path) as file:
        return {name: data[:] for name, data in file["energy"].items()}


def cloud(path, step: int) -> dict[str, np.ndarray]:
    with h5py.File(path) as file:
        group = file[f"data/{step}/particles/cloud"]
        vectors = {
            k: np.stack([group[k][a][:] for a in "xyz"], 1) for k in ("position", "velocity")
        }
        return vectors | {k: group[k][:] for k in ("id", "kind", "mass", "radius", "type")}


def test_the_block_is_what_it_is(tmp_path):
    path, notes = imported(tmp_path, write(tmp_path / "a.dump"))
    run = open_run(path)
    assert run.time == pytest.approx([0.0, 0.02, 0.05])
    assert run_out(run) == pytest.approx(0.9, abs=1e-12)
    assert run.mass == pytest.approx(MASS, rel=1e-12)
    for k, (step, s) in enumerate(STEPS.items()):
        here, true = cloud(path, step), grains(s)
        assert np.array_equal(here["id"], true["id"]) and np.sum(here["kind"] == 3) == 60
        assert here["position"][:, 0] == pytest.approx(true["x"], abs=1e-15)
    e, moving = energy(path), slice(0, 300)
    heights = np.array([grains(s)["y"][moving].sum() for s in STEPS.values()])
    assert e["potential"] == pytest.approx(9.81 * RHO * VOLUME * heights, rel=1e-12)
    kinetic = [sum(np.sum(grains(s)[v][moving] ** 2) for v in ("vx", "vy")) for s in STEPS.values()]
    assert e["kinetic"] == pytest.approx(0.5 * RHO * VOLUME * np.array(kinetic), rel=1e-12)
    assert not np.any(e["lost"]) and not np.any(e["unaccounted"])
    total = e["kinetic"] + e["potential"] + e["rotational"]
    assert e["dissipated"] == pytest.approx(total[0] - total, abs=1e-15)
    with h5py.File(path) as file:
        told = dict(file.attrs)
    assert told["diameter"] == pytest.approx(D) and told["density"] == pytest.approx(RHO)
    assert told["gravity"] == pytest.approx([0.0, -9.81, 0.0]) and list(told["periodic"]) == [
        0,
        0,
        1,
    ]
    assert told["wall_low"][:2] == pytest.approx([0.0, 0.0]) and "case_resolved" in told
    assert "walls: 60 grains never move: part of the wall" in notes
    assert not any("vanished" in note or "merged" in note for note in notes)


def lose(step, columns):
    gone = 60 if step == 5000 else 0
    order = np.argsort(-columns["x"][:300])[:gone]  # the farthest
    return {k: np.delete(v, order) for k, v in columns.items()}


def test_what_vanishes_is_an_account_of_its_own(tmp_path):
    path, notes = imported(tmp_path, write(tmp_path / "a.dump", lose))
    e = energy(path)
    before, far = grains(STEPS[2000]), np.argsort(-grains(1.0)["x"][:300])[:60]
    m = RHO * VOLUME
    held = 0.5 * m * sum(np.sum(before[v][far] ** 2) for v in ("vx", "vy"))
    height = 9.81 * m * before["y"][far].sum()
    assert e["lost"] == pytest.approx([0.0, 0.0, held + height], rel=1e-12)
    assert e["lost_potential"][-1] == pytest.approx(height, rel=1e-12)
    total = e["kinetic"] + e["potential"]
    assert e["dissipated"] == pytest.approx(total[0] - total - e["lost"], rel=1e-12)
    assert any(note.startswith("vanished: 60 of 300 grains") for note in notes)
    # The released energy is that of the grains that are there; the budget closes with the account.
    run = open_run(path)
    assert run.released() == pytest.approx(e["potential"][0] - e["potential"][-1] - height)
    accounts = {one.name: one for one in budget(run, split=False)}
    assert accounts["lost with grains"].values[-1] == pytest.approx(held + height)
    assert accounts["lost with grains"].kind == "numerical"
    assert abs(accounts["residual"].values[-1]) < 1e-12 * total[0]
    assert accounts["all mechanisms"].kind == "dissipated"


def test_what_comes_later_is_said(tmp_path):
    def late(step, columns):
        first = 30 if step == 0 else 0
        return {k: v[first:] for k, v in columns.items()}

    path, notes = imported(tmp_path, write(tmp_path / "a.dump", late))
    assert "came: 30 grains are in later frames only" in notes
    assert energy(path)["lost"][1] < 0.0


def test_parts_of_a_frame_are_joined(tmp_path):
    def part(k):
        return lambda step, columns: {name: v[k::2] for name, v in columns.items()}

    files = [write(tmp_path / f"{k}.dump", part(k)) for k in range(2)]
    path, notes = imported(tmp_path, *files)
    assert len(open_run(path).clouds[0].mass) == 300
    assert run_out(open_run(path)) == pytest.approx(0.9, abs=1e-12)
    assert "merged: frames of up to 2 parts each" in notes


def test_after_a_restart_the_later_file_counts(tmp_path):
    def wrong(step, columns):
        return columns | {"x": columns["x"] + (0.001 if step == 2000 else 0.0)}

    early = write(tmp_path / "a.dump", wrong, steps=[0, 2000])
    late = write(tmp_path / "b.dump", steps=[2000, 5000])
    path, notes = imported(tmp_path, early, late)
    assert cloud(path, 2000)["position"][:, 0] == pytest.approx(grains(0.4)["x"], abs=1e-15)
    assert any("later one counts" in note and "step 2000" in note for note in notes)
    path, _ = imported(tmp_path, late, early)  # the order of the files decides
    assert cloud(path, 2000)["position"][0, 0] == pytest.approx(grains(0.4)["x"][0] + 0.001)


def test_a_frame_that_shares_some_grains_is_refused(tmp_path):
    def some(step, columns):
        return {name: v[100:] for name, v in columns.items()}

    early = write(tmp_path / "a.dump", steps=[0, 2000])
    late = write(tmp_path / "b.dump", some, steps=[2000, 5000])
    with pytest.raises(CaseError, match=r"b.dump\S*: step 2000: grain 101 is in .*a.dump\S* too"):
        imported(tmp_path, early, late)


def spoilt(name, value, row=7):
    def change(step, columns):
        values = columns[name].astype(float)
        values[row] = value
        return columns | {name: values}

    return change


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("x", np.nan, "grain 8: position is no number"),
        ("vy", np.inf, "grain 8: velocity is no number"),
        ("radius", 0.0, "grain 8: radius is not positive: 0"),
        ("radius", -0.001, "grain 8: radius is not positive: -0.001"),
        ("id", 5, "grain 5 is there twice"),
        ("id", 7.5, ".*7.5"),
    ],
)
def test_grains_that_are_none_are_refused_by_id(tmp_path, name, value, message):
    with pytest.raises(CaseError, match=rf"a.dump\S*: {message}"):
        imported(tmp_path, write(tmp_path / "a.dump", spoilt(name, value)))
    assert not (tmp_path / "grains.h5").exists()


def test_a_mass_that_is_not_positive_is_refused(tmp_path):
    def massive(step, columns):
        return columns | {"mass": np.where(columns["id"] == 8, 0.0, 1e-5)}

    file = write(tmp_path / "a.dump", massive, names="id x y z vx vy vz radius mass")
    with pytest.raises(CaseError, match="grain 8: mass is not positive: 0"):
        imported(tmp_path, file)


def test_the_file_tells_masses_first(tmp_path):
    names = "id type x y z vx vy vz radius"

    def heavy(step, columns):
        return columns | {"mass": np.full(360, 1e-5), "density": np.full(360, 1500.0)}

    def density(name_list, **more):
        file = write(tmp_path / "a.dump", heavy, names=name_list)
        path, notes = imported(tmp_path, file, **more)
        with h5py.File(path) as f:
            return float(f.attrs["density"]), notes

    assert density(names)[0] == pytest.approx(RHO)
    assert density(names, density=1000.0)[0] == pytest.approx(1000.0)
    assert density(f"{names} density", density=1000.0)[0] == pytest.approx(1500.0)
    found, notes = density(f"{names} mass density", density=1000.0)
    assert found == pytest.approx(1e-5 / VOLUME)
    assert sum(note.startswith("disagrees: density") for note in notes) == 2  # option and case
    with pytest.raises(CaseError, match="no column mass or density .* give --density"):
        imported(tmp_path, write(tmp_path / "a.dump"), scene=None)


def test_radii_of_the_file_are_the_truth(tmp_path):
    radius = np.random.default_rng(1).uniform(0.0006, 0.001, 360)
    file = write(tmp_path / "a.dump", lambda step, columns: columns | {"radius": radius})
    path, notes = imported(tmp_path, file)
    run = open_run(path)
    assert run.mass == pytest.approx(RHO * 4 / 3 * np.pi * np.sum(radius[:300] ** 3), rel=1e-12)
    d43 = 2 * np.sum(radius[:300] ** 4) / np.sum(radius[:300] ** 3)
    assert run.diameter == pytest.approx(d43, rel=1e-12)
    assert any(note.startswith("disagrees: diameter") for note in notes)
    same, notes = imported(tmp_path, write(tmp_path / "a.dump"))
    assert not any(note.startswith("disagrees: diameter") for note in notes)


@pytest.mark.parametrize("factor", [1000.0, 0.2])
def test_another_scene_is_refused(tmp_path, factor):
    def scaled(step, columns):
        return columns | {k: factor * columns[k] for k in ("x", "y", "z", "radius")}

    flags, corners = "mm mm pp", [
        (factor * a, factor * b) for a, b in ((-0.1, 0.3), (-1, 1), (0, 0.006))
    ]
    file = write(tmp_path / "a.dump", scaled, box=(flags, corners))
    with pytest.raises(CaseError, match=r"diameter .* \(another scene, or other units\)"):
        imported(tmp_path, file)


def test_one_frame_has_no_walls_that_anybody_knows(tmp_path):
    file = write(tmp_path / "a.dump", steps=[0])
    path, notes = imported(tmp_path, file)
    assert len(open_run(path).clouds[0].mass) == 360
    assert any("--wall-type 3 makes them wall" in note for note in notes)
    path, notes = imported(tmp_path, file, walls=Chosen(types=(3,)))
    assert len(open_run(path).clouds[0].mass) == 300
    path, _ = imported(tmp_path, file, walls=Chosen(ids=((301, 330), (331, 360))))
    assert len(open_run(path).clouds[0].mass) == 300
    assert np.isnan(open_run(path).released()) and len(energy(path)["kinetic"]) == 1


def test_walls_are_what_never_moves(tmp_path):
    def nudged(step, columns):
        there = (columns["id"] == 360) & (step == 2000)
        return columns | {"x": columns["x"] + 1e-5 * there}

    file = write(tmp_path / "a.dump", nudged)
    assert len(open_run(imported(tmp_path, file)[0]).clouds[0].mass) == 301

    def restless(step, columns):  # at its place in every frame, but on the way
        return columns | {"vx": np.where(columns["id"] == 360, 1e-3, columns["vx"])}

    other = write(tmp_path / "b.dump", restless)
    assert len(open_run(imported(tmp_path, other)[0]).clouds[0].mass) == 301
    path, _ = imported(tmp_path, file, walls=Chosen(frozen=False), origin=(0.0, 0.0, 0.0))
    assert len(open_run(path).clouds[0].mass) == 360
    with pytest.raises(CaseError, match="no grain is of --wall-type"):
        imported(tmp_path, file, walls=Chosen(types=(9,)))


def test_frames_need_a_time_to_be_compared(tmp_path):
    file = write(tmp_path / "a.dump")
    with pytest.raises(CaseError, match="give --time-step"):
        imported(tmp_path, file, time_step=None)
    path, notes = imported(tmp_path, file, time_step=None, scene=None, density=RHO)
    with h5py.File(path) as f:
        assert np.isnan(f["data/2000"].attrs["time"]) and "case_resolved" not in f.attrs
    assert any(note.startswith("absent: times") for note in notes)


def test_a_frame_that_was_cut_short(tmp_path):
    file = write(tmp_path / "a.dump")
    lines = file.read_text().splitlines(keepends=True)
    file.write_text("".join(lines[: 2 * 369 + 3]))  # a frame has nine lines and 360 rows
    with pytest.raises(CaseError, match="a.dump:741"):
        imported(tmp_path, file)
    path, notes = imported(tmp_path, file, skip_incomplete=True)
    assert len(open_run(path).time) == 2 and any("a.dump:741" in note for note in notes)


def test_the_command_never_overwrites_by_itself(tmp_path, capsys):
    file, out = write(tmp_path / "a.dump"), tmp_path / "grains.h5"
    words = ["import", str(file), "-o", str(out), "--time-step", str(DT), "--density", "2500"]
    assert cli.main(words) == 0
    said = capsys.readouterr().out
    for word in (
        "360 grains, 60 of them wall",
        "3 frames, t = 0 to 0.05 s",
        "d = 2 mm",
        "periodic",
    ):
        assert word in said
    before = out.read_bytes()
    assert cli.main(words) == 2 and "--force" in capsys.readouterr().err
    file.write_text(file.read_text().replace("ITEM: BOX", "hello"))
    assert cli.main([*words, "--force"]) == 2 and len(capsys.readouterr().err.splitlines()) == 1
    assert out.read_bytes() == before and sorted(p.name for p in tmp_path.iterdir()) == [
        "a.dump",
        "grains.h5",
    ]
    write(file)
    assert cli.main([*words, "--force", "--quiet"]) == 0
    assert cli.main(["import", str(file), "-o", str(file), "--force"]) == 2


def test_a_bad_format_is_refused_by_name(tmp_path, capsys):
    file = write(tmp_path / "a.dump")
    words = ["import", str(file), "-o", str(tmp_path / "g.h5")]
    assert cli.main([*words, "--format", "nonsense"]) == 2
    assert "--format: 'nonsense' is not known" in capsys.readouterr().err
    (tmp_path / "b.dump").write_text("hello\n")
    assert cli.main(["import", str(tmp_path / "b.dump"), "-o", str(tmp_path / "g.h5")]) == 2
    assert "b.dump" in capsys.readouterr().err


def test_implausible_grains_are_said(tmp_path):
    def large(step, columns):
        return columns | {"radius": 1.4 * columns["radius"]}

    _, notes = imported(tmp_path, write(tmp_path / "a.dump", large))
    assert any("solid fraction of 1" in note or "solid fraction of 0.9" in note for note in notes)
    assert any("overlap" in note for note in notes)
    _, notes = imported(tmp_path, write(tmp_path / "a.dump", steps=[0]))
    assert not any("implausible" in note for note in notes)


def test_lengths_of_the_case_are_told(tmp_path):
    file = write(tmp_path / "a.dump", lambda step, columns: columns | {"x": 1.1 * columns["x"]})
    _, notes = imported(tmp_path, file)
    assert any(
        note.startswith("disagrees: length 0.0218 m, the case 0.02 (+9 %)") for note in notes
    )
    assert SCENE["geometry.length"] == L
