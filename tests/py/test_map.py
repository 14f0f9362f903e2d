"""Grains mapped alone, without a case: known packings, and a real one of another code."""

from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from grains_file import DENSITY, SCENE, D, G, column, write_grains
from synthetic import write_run

from cases import reading
from cases.errors import CaseError
from cases.programs import ROOT
from compare.__main__ import main
from compare.mapping.runs import map_fields

SHARED = ROOT.parent / "shared" / "inputs" / "lammps_box"


def fields(path, *options, name=None):
    """Arrays of the fields of a file mapped with options, and the centres of cells."""
    out = path.with_suffix(".fields.h5")
    map_fields([path], out, *options)
    with h5py.File(out) as f:
        found = {key: data[:] for key, data in f[name or path.stem].items()}
        grid = {key: data[:] for key, data in f["grid"].items()}
        attributes = reading.attributes(f) | reading.attributes(f["grid"])
    return found, grid, attributes


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_mass_and_stress_of_a_lattice_that_crosses_its_faces(tmp_path, dimension):
    frame = column(force=1e-4)
    found, _, about = fields(
        write_grains(tmp_path / "g.h5", [frame], **SCENE), "--dimension", str(dimension)
    )
    axes = tuple(range(found["density"].ndim))
    volume = about["cell_volume"]
    mass = (DENSITY * np.pi / 6 * D**3) * len(frame["x"])
    assert found["density"].sum(axis=axes) * volume == pytest.approx(mass, rel=1e-12)
    # All of f (x) b lies in the domain, whatever faces it crosses; stored in single precision.
    total = found["contact_stress"].astype(float).sum(axis=axes) * volume
    contacts = frame["contacts"]
    exact = np.einsum("ci,cj->ij", contacts["force"], contacts["branch"])
    assert total == pytest.approx(exact, abs=1e-6 * abs(exact).max())
    # The same stress in every x: the force of one contact per d x d.
    if dimension == 2:
        row = found["contact_stress"][0, 4, :, 0, 0]
        assert row == pytest.approx(np.full(6, 1e-4 / D**2), rel=1e-5)


def test_contacts_across_faces_count_and_a_control_without_them(tmp_path):
    frame = column(force=1e-4)
    whole, _, about = fields(write_grains(tmp_path / "a.h5", [frame], **SCENE))
    contacts = frame["contacts"]
    ends = [frame["x"][np.maximum(contacts[k], 1) - 1] for k in ("first", "second")]
    direct = (contacts["second"] < 0) | (np.abs(ends[0] - ends[1]).max(axis=1) < 1.5 * D)
    frame["contacts"] = {name: values[direct] for name, values in contacts.items()}
    less, _, _ = fields(write_grains(tmp_path / "b.h5", [frame], **SCENE))
    share = less["contact_stress"][..., 0, 0].sum() / whole["contact_stress"][..., 0, 0].sum()
    assert share == pytest.approx(5 / 6, rel=1e-5)  # one of six contacts in a row crosses


def test_profiles_along_every_axis_and_over_a_range(tmp_path):
    frame = column()
    path = write_grains(tmp_path / "g.h5", [frame], **SCENE)
    uniform = np.pi / 6  # solid fraction of the lattice
    for along in "xz":
        found, grid, about = fields(path, "--dimension", "1", "--along", along)
        assert along in grid
        assert found["solid_fraction"][0] == pytest.approx(uniform, rel=0.02)
    half, _, about = fields(path, "--dimension", "1", "--range", "0", str(3 * D))
    assert about["depth"] == pytest.approx(3 * D * 4 * D)
    whole, _, _ = fields(path, "--dimension", "1")
    assert half["density"][0] == pytest.approx(whole["density"][0], rel=1e-9)
    # over a range across the face of the domain
    over, _, _ = fields(path, "--dimension", "1", "--range-x", str(-1 * D), str(2 * D))
    assert over["density"][0] == pytest.approx(whole["density"][0], rel=1e-9)
    with pytest.raises(CaseError, match="longer than the period"):
        fields(path, "--dimension", "1", "--range-x", "0", "1")


def test_a_box_that_shrinks_is_followed(tmp_path):
    frames = []
    for k, scale in enumerate((1.0, 0.9)):
        frame = column()
        frame["x"] = frame["x"] * [scale, 1.0, 1.0]
        frame["upper"] = frame["upper"] * [scale, 1.0, 1.0]
        frames.append(frame | {"time": float(k)})
    found, _, _ = fields(write_grains(tmp_path / "g.h5", frames, **SCENE))
    mass = found["density"].sum(axis=(1, 2)) * found["cell_volume"]
    assert mass[1] == pytest.approx(mass[0], rel=1e-12)
    assert found["cell_volume"][1] == pytest.approx(0.9 * found["cell_volume"][0])
    assert found["solid_fraction"][1].max() > 1.05 * found["solid_fraction"][0].max()
    with pytest.raises(CaseError, match="no steady flow"):
        fields(tmp_path / "g.h5", "--average")


def test_grains_off_their_box_are_wrapped(tmp_path):
    frame = column()
    inside, _, _ = fields(write_grains(tmp_path / "a.h5", [frame], **SCENE))
    frame["x"] = frame["x"] + [600 * D, 0.0, -4 * D]  # images far beyond what a byte can count
    outside, _, _ = fields(write_grains(tmp_path / "b.h5", [frame], **SCENE))
    assert outside["contact_stress"] == pytest.approx(inside["contact_stress"], rel=1e-4)
    assert outside["density"] == pytest.approx(inside["density"], rel=1e-9)


def test_average_of_a_steady_flow(tmp_path):
    random = np.random.default_rng(1)
    frames = []
    for k in range(8):
        frame = column(n=(8, 10, 8))
        frame["v"] = random.normal(0.0, 0.1, frame["x"].shape) + [3.0 * (-1) ** k, 0.0, 0.0]
        frames.append(frame | {"time": 0.1 * k})
    path = write_grains(tmp_path / "g.h5", frames, **SCENE)
    found, grid, _ = fields(path, "--average", "--dimension", "1")
    bulk = (grid["y"] > 2 * D) & (grid["y"] < 8 * D)
    assert len(found["density"]) == 1
    assert found["time"][0] == pytest.approx(0.35)
    # 4000 grains in the bulk: a scatter of 1 %; the mean's swing of 3 m/s is no heat
    assert found["granular_temperature"][0, bulk].mean() == pytest.approx(0.01, rel=0.05)
    swing = found["mean_fluctuation_stress"][0, bulk, 0, 0] / found["density"][0, bulk]
    assert swing == pytest.approx(9.0, rel=0.02)
    some, _, _ = fields(path, "--average", "--span", "0.15", "0.35", "--dimension", "1")
    assert some["time"][0] == pytest.approx(0.25)
    with pytest.raises(CaseError, match="no frame from 5 to 6 s"):
        fields(path, "--average", "--span", "5", "6")


def test_grains_behind_a_wall_are_not_folded(tmp_path):
    frame = column()
    frame["x"][0] = [0.5 * D, -5 * D, 0.5 * D]
    frame["contacts"]["branch"][0] = [0.0, D, 0.0]
    del frame["contacts"]
    found, grid, about = fields(write_grains(tmp_path / "g.h5", [frame], **SCENE))
    assert "grains lie below the wall at y = 0 m" in about["notes"]
    assert grid["y"].min() < -5 * D


def test_sizes_of_grains_without_mass_and_density(tmp_path):
    frame = column()
    path = write_grains(tmp_path / "g.h5", [frame], **SCENE)
    whole, _, _ = fields(path)
    with h5py.File(path, "r+") as f:
        del f["data/0/particles/cloud/mass"], f["data/0/particles/cloud/solid_volume"]
    with pytest.raises(CaseError, match="--density"):
        fields(path)
    told, _, _ = fields(path, "--density", str(DENSITY))
    assert told["density"] == pytest.approx(whole["density"], rel=1e-12)


def test_threads_change_nothing(tmp_path):
    path = write_grains(tmp_path / "g.h5", [column(force=1e-4)], **SCENE)
    one, _, _ = fields(path, "--threads", "1")
    three, _, _ = fields(path, "--threads", "3")
    for name in one:
        assert np.array_equal(one[name], three[name], equal_nan=True), name


# The page -------------------------------------------------------------------------------------


def test_the_page_of_grains_alone(tmp_path, capsys):
    path = write_grains(tmp_path / "heap.h5", [column(n=(6, 14, 6))], **SCENE)
    out = tmp_path / "out"
    assert main(["map", str(path), "-o", str(out), "--width-study", "--quiet"]) == 0
    assert {p.name for p in out.iterdir()} == {"fields.h5", "profiles.csv", "figures", "map.html"}
    page = (out / "map.html").read_text()
    for words in ("Momentum balance", "Width of the kernel", "rotational temperature", "one frame"):
        assert words in page
    table = pd.read_csv(out / "profiles.csv", comment="#")
    # the middle of the lattice carries half of it
    weight = 14 * DENSITY * np.pi / 6 * D * G
    middle = np.interp(7 * D, table["y"], table["contact_stress_yy"])
    assert middle == pytest.approx(weight / 2, rel=0.02)
    said = capsys.readouterr().out
    closing = float(said.split("closing error")[1].split(", y ")[1].split(",")[0])
    assert closing < 1e-3  # of difference quotients at w/16: (h/w)^2/6
    assert float(said.split("lacks hold ")[1].split(" %")[0]) < 0.1  # the floor's force is told


def test_without_contacts_the_page_says_so(tmp_path, capsys):
    frame = column()
    del frame["contacts"]
    path = write_grains(tmp_path / "heap.h5", [frame], **SCENE)
    assert main(["map", str(path), "-o", str(tmp_path / "out"), "--quiet"]) == 0
    page = (tmp_path / "out" / "map.html").read_text()
    assert "no contacts" in page and "Not checked" in page
    assert "contact stress, pressure" in capsys.readouterr().out


@pytest.mark.parametrize("engine", ["dem", "mpm"])
def test_runs_of_ours_are_mapped_alone(tmp_path, engine):
    write_run(tmp_path / f"{engine}.h5", engine, frames=3)
    out = tmp_path / "out"
    assert main(["map", str(tmp_path / f"{engine}.h5"), "-o", str(out), "--quiet"]) == 0
    assert len(pd.read_csv(out / "profiles.csv", comment="#")["frame"].unique()) == 3


def test_a_bad_file_gives_exit_code_2_and_no_folder(tmp_path, capsys):
    (tmp_path / "a.h5").write_text("no")
    assert main(["map", str(tmp_path / "a.h5"), "-o", str(tmp_path / "out")]) == 2
    assert not (tmp_path / "out").exists()


# Another code's packing -----------------------------------------------------------------------


def lammps_rows(path: Path, head: str) -> tuple[list[str], np.ndarray]:
    lines = path.read_text().splitlines()
    start = max(k for k, line in enumerate(lines) if line.startswith(head))
    names = lines[start].split()[2:]
    return names, np.array([line.split() for line in lines[start + 1 :]], float)


@pytest.mark.skipif(not SHARED.exists(), reason="inputs of other codes are not here")
def test_a_settled_box_of_lammps(tmp_path):
    names, rows = lammps_rows(SHARED / "s_diam.dump", "ITEM: ATOMS")
    of = dict(zip(names, rows.T))
    turn = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # z up -> y up, right-handed
    x = np.stack([of["x"], of["y"], of["z"]], 1) @ turn.T
    _, pairs = lammps_rows(SHARED / "contacts.local", "ITEM: ENTRIES")
    where = {int(number): k for k, number in enumerate(of["id"])}
    a, b = (np.array([where[int(number)] for number in pairs[:, k]]) for k in (0, 1))
    branch = x[a] - x[b]
    branch -= np.round(branch * [100, 0, 100]) * 0.01
    force = (pairs[:, 3:6] + pairs[:, 6:9]) @ turn.T  # normal, tangential
    touch = abs(force).sum(axis=1) > 0
    contacts = {
        "first": of["id"][a],
        "second": of["id"][b],
        "branch": branch,
        "position": x[a] - 0.5 * branch,
        "force": force,
    }
    frame = {
        "time": np.nan,
        "lower": np.array([0.0, 0.0, -0.01]),
        "upper": np.array([0.01, 0.06, 0.0]),
        "x": x,
        "v": np.stack([of["vx"], of["vy"], of["vz"]], 1) @ turn.T,
        "radius": 0.5 * of["diameter"],
        "density": 2500.0,
        "id": of["id"],
        "contacts": {name: values[touch] for name, values in contacts.items()},
    }
    path = write_grains(tmp_path / "box.h5", [frame], **SCENE)
    found, grid, about = fields(path, "--dimension", "1", "--spacing", "0.1")
    y = grid["y"]
    assert found["density"][0].sum() * about["cell_volume"] == pytest.approx(1.493719e-3, rel=1e-6)
    middle = (y > 3e-3) & (y < 8e-3)
    assert found["solid_fraction"][0, middle].mean() == pytest.approx(0.5883, abs=2e-3)
    stress = found["contact_stress"][0, :, 1, 1]
    assert np.interp(3.5e-3, y, stress) == pytest.approx(98.60, rel=5e-4)
    # control: without what crosses x = 0 it reads less
    inner = abs(x[a, 0] - x[b, 0]) < 5e-3
    frame["contacts"] = {name: values[touch & inner] for name, values in contacts.items()}
    less, grid, _ = fields(
        write_grains(tmp_path / "less.h5", [frame], **SCENE), "--dimension", "1", "--spacing", "0.1"
    )
    read = np.interp(3.5e-3, grid["y"], less["contact_stress"][0, :, 1, 1])
    assert read < 0.98 * 98.60
