"""A layer that flows down a plane: its case, grains and profiles, from one command to a page."""

import json
import os
import re
import shutil
import signal
import subprocess
import time
from types import SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pytest

from bagnold import DEPTH, D, NU, SLOPE, bagnold_profile, measured
from bits import differences
from cases.case import load
from cases.errors import CaseError
from cases.programs import ROOT, module, program
from cases.scenes import gravity_of, is_chute
from compare.__main__ import main as grainpair
from compare.chute import flow, report, sides
from compare.chute.published import at
from compare.judge import steady
from compare.judge.flow import cells
from dem_reference import base, content
from dem_reference.run import main as run_grains
from watched import seen

CASE = "cases/chute_ci"


def refusal(*sets: str, path: str = CASE) -> str:
    with pytest.raises(CaseError) as error:
        load(path, sets)
    return str(error.value)


@pytest.mark.parametrize(
    "assignment, words",
    [
        ("walls.left=coulomb", "no left wall"),
        ("walls.gate=lifted", "it has no gate"),
        ("walls.front_back=smooth", "it repeats across the flow"),
        ("initial.state=packing", "no packing of a chute is mapped"),
        ("geometry.dimension=axisymmetric", "a plane has no axis"),
        ("mpm.transfer=xpic", "its sweeps know no period"),
        ("geometry.floor_length=0.1", "ends nowhere"),
        ("mpm.cell_size=0.003", "takes 6 cells"),
        ("mpm.cell_size=0.0009", "no whole number of cells"),
    ],
)
def test_what_contradicts_a_chute_is_refused(assignment, words):
    told = refusal(assignment)
    assert words in told and "\n" not in told and assignment.split("=")[0] in told


def test_a_chute_has_an_inclination_and_a_collapse_has_none(tmp_path):
    text = '[geometry]\nscene = "chute"\nheight = 0.1\nlength = 0.1\nthickness = 0.02\n'
    column = load("cases/column_ci")
    assert "geometry.inclination = 20" in refusal("geometry.inclination=20", path="cases/column_ci")
    assert not is_chute(column["geometry"]) and "scene" not in column["geometry"]
    assert gravity_of(column["geometry"]) == (0.0, column["geometry.gravity"])
    (tmp_path / "case.toml").write_text(text + "[grains]\n")
    assert "missing key" in refusal(path=str(tmp_path / "case.toml"))


def test_a_collapse_must_say_where_its_floor_ends(tmp_path):
    lines = [
        line
        for line in load("cases/column_ci").resolved.splitlines()
        if not line.startswith("floor_length")
    ]
    (tmp_path / "case.toml").write_text("\n".join(lines))
    told = refusal(path=str(tmp_path / "case.toml"))
    assert told.startswith(f"{tmp_path}/case.toml: missing key 'geometry.floor_length' (Length of")


def test_a_packing_is_that_of_every_inclination():
    keys = [content.packing_key(load(CASE, [f"geometry.inclination={a}"]), 1) for a in (20, 25)]
    assert keys[0] == keys[1]
    assert keys[0] != content.packing_key(load(CASE, ["geometry.length=0.014"]), 1)


def test_the_base_is_as_dense_as_a_slice_of_a_packing_and_rough():
    """More centres than a slice so thick of grains packed at random has (solid fraction 0.64), none
    nearer than the least distance, across the seams either, tops at the plane or below; no holes;
    and its surface scatters by more than a quarter of a diameter.
    """
    d = 2.0
    places = base.rough_base(10 * d, 6 * d, d, 3)
    slice_of_packing = 0.64 * 10 * 6 * base.DEEPEST / (np.pi / 6)
    assert len(places) > slice_of_packing
    assert len(places) == pytest.approx(base.rough_count(10 * d, 6 * d, d), rel=0.1)
    assert places[:, 1].max() <= -0.5 * d
    apart = places[:, None] - places
    for axis, size in ((0, 10 * d), (2, 6 * d)):
        apart[..., axis] -= size * np.rint(apart[..., axis] / size)
    distance = np.linalg.norm(apart, axis=-1) + 10 * d * np.eye(len(places))
    assert distance.min() >= base.CLOSEST * d
    grid = np.stack(np.meshgrid(np.arange(0, 20, 0.5), np.arange(0, 12, 0.5)), -1).reshape(-1, 2)
    off = grid[:, None] - places[:, [0, 2]]
    off -= np.array([20.0, 12.0]) * np.rint(off / np.array([20.0, 12.0]))
    height = places[:, 1] + np.sqrt(np.maximum((d / 2) ** 2 - (off**2).sum(-1), 0.0))
    covered = (off**2).sum(-1) < (d / 2) ** 2
    top = np.where(covered, height, -9.0).max(axis=1)
    assert (top > -9.0).mean() > 0.85
    assert top[top > -9.0].std() > 0.25 * d


@pytest.fixture(scope="module")
def grains(tmp_path_factory):
    """The smallest chute on its first way, every step audited."""
    folder = tmp_path_factory.mktemp("chute")
    words = ["time.maximum=4.0", "dem.audit_interval=1", "time.frame_interval=0.5"]
    sets = [word for one in words for word in ("--set", one)]
    path = folder / "dem.h5"
    store = ["--packings", str(folder / "packings"), "--quiet"]
    assert run_grains([CASE, "-o", str(path), *sets, *store]) == 0
    return path


def test_energies_close_and_gravity_drives(grains):
    """The work along the slope is that of the grains' way between frames, and what it puts in is
    held or dissipated: within 1 %, as of collapses this small. Without it nothing would close.
    """
    case = load(CASE)
    with h5py.File(grains) as file:
        energy = {name: values[()] for name, values in file["energy"].items()}
        force_error = file.attrs["force_error"]
        weight = file["packing"].attrs["mass"] * case["geometry.gravity"]
        x = []
        for step in sorted(file["data"], key=int):
            cloud = file[f"data/{step}/particles/cloud"]
            x.append(cloud["position/x"][()][cloud["kind"][()] == 1])
        mass = file["packing"].attrs["mass"] / len(x[0])
    assert force_error < 1e-9 * weight  # all forces are known, those across the seam too
    length, pull = case["geometry.length"], gravity_of(case["geometry"])[0]
    way = np.diff(x, axis=0)
    way -= length * np.rint(way / length)
    assert energy["driven"][-1] == pytest.approx(mass * pull * way.sum(), rel=1e-9)
    assert energy["kinetic"][-1] > 0.0 and energy["driven"][-1] > 0.0
    assert abs(energy["unaccounted"]).max() < 0.01 * energy["driven"][-1]
    assert np.any(np.abs(np.diff(x, axis=0)) > length / 2)  # some crossed the seam


def test_a_chute_is_not_driven_by_a_script(grains, capsys):
    words = [CASE, "-o", str(grains.with_name("other.h5")), "--driver", "script", "--quiet"]
    assert run_grains(words) == 2
    assert "geometry.scene: a script does not book" in capsys.readouterr().err


def test_a_layer_that_is_begun_in_flow_has_that_velocity(tmp_path):
    """Of either engine, growing evenly from the base; the grains' energies close with it, and a
    column has none. Negative control: without it they begin at rest.
    """
    fast, found = 0.2, {}
    engines: dict[str, list] = {"mpm": [program("mpm_run")], "dem": module("dem_reference.run")}
    for engine, words in engines.items():
        for velocity in (0.0, fast):
            path = tmp_path / f"{engine}_{velocity}.h5"
            sets = [f"initial.velocity={velocity}", "time.maximum=1.0", "time.frame_interval=0.5"]
            told = [word for one in (*sets, "dem.audit_interval=1") for word in ("--set", one)]
            command = [*words, CASE, "-o", path, "--quiet", *told]
            assert subprocess.run(command, cwd=ROOT, check=False).returncode == 0
            with h5py.File(path) as file:
                cloud = file["data/0/particles/cloud"]
                moves = (
                    cloud["kind"][()] == 1 if "kind" in cloud else np.ones(len(cloud["id"]), bool)
                )
                v, y = cloud["velocity/x"][()][moves], cloud["position/y"][()][moves]
                found[engine, velocity] = v
                if velocity:
                    top = load(CASE)["geometry.height"]
                    line = 2 * fast * np.clip(y / top, 0.0, 1.0)
                    assert v == pytest.approx(line, abs=0.02 * fast), engine
                    # grains settle a little lower than the case's height
                    assert v.mean() == pytest.approx(fast, rel=0.1), engine
                    energy = {name: values[()] for name, values in file["energy"].items()}
                    given = energy["driven"][-1] + energy["kinetic"][0]
                    assert energy["kinetic"][0] > 0.0
                    if engine == "dem":
                        assert abs(energy["unaccounted"]).max() < 0.01 * given
    assert all(abs(found[engine, 0.0]).max() < 0.05 * fast for engine in ("mpm", "dem"))
    assert "(a column is let go from rest)" in refusal(
        "initial.velocity=0.1", path="cases/column_ci"
    )
    keys = [content.packing_key(load(CASE, [f"initial.velocity={v}"]), 1) for v in (0, 0.1)]
    runs = [content.ensemble_key(load(CASE, [f"initial.velocity={v}"])) for v in (0, 0.1)]
    assert keys[0] == keys[1] and runs[0] != runs[1]


def test_a_known_profile_is_measured():
    found = measured(bagnold_profile()).figures
    assert found["depth"] == pytest.approx(DEPTH / D, rel=1e-3)
    assert found["solid_fraction"] == pytest.approx(NU, rel=1e-9)
    assert found["temperature_ratio"] == pytest.approx(0.4, rel=1e-6)
    assert found["stress_ratio"] == pytest.approx(np.tan(np.radians(SLOPE)), rel=1e-9)
    assert found["bagnold"] == pytest.approx(1.5, abs=0.02)
    # half a cell's weight at the surface, 0.5 % of the depth
    assert found["normal_balance"] < 0.006 and found["shear_balance"] < 0.006


def test_what_is_off_is_found_off():
    """Negative controls: another exponent, 3 % of the shear stress, flows that change."""
    assert measured(bagnold_profile(power=2.0)).figures["bagnold"] == pytest.approx(2.0, abs=0.03)
    wrong = measured(bagnold_profile(off=1.03)).figures
    assert wrong["shear_balance"] > 0.02 and wrong["normal_balance"] < 0.006
    assert measured(bagnold_profile()).state == "steady"
    assert measured(bagnold_profile(), (1.0, 1.2)).state == "speeds up"
    assert measured(bagnold_profile(), (1.0, 0.8)).state == "slows down"
    assert measured(bagnold_profile(), (0.0, 0.0)).state == "stopped"


def test_points_that_crowd_are_found():
    profile = bagnold_profile()
    assert np.isnan(measured(profile).figures["crowding"])  # grains have no void ratio of their own
    for void_ratio, crowding in ((1 / NU - 1, 0.0), (1.2 / NU - 1, 0.2)):
        profile.fields["void_ratio_state"] = np.full(len(profile.place), void_ratio)
        assert measured(profile).figures["crowding"] == pytest.approx(crowding, abs=1e-9)


def test_published_facts_are_those_of_the_angle():
    facts = {one.figure: one.value for one in at(26.0, 0.2)}
    assert facts["solid_fraction"] == pytest.approx(0.58)
    assert facts["bagnold"] == 1.5
    mu = np.tan(np.radians(26.0))
    assert 0.382 + (0.643 - 0.382) / (1 + 0.279 / facts["inertial_number"]) == pytest.approx(mu)
    assert {one.figure: one.value for one in at(20.0, 0.0)}["inertial_number"] == 0.0
    assert flow.power([1.0, 2.0, 4.0], [1.0, 2**1.5, 8.0]) == pytest.approx(1.5)


def test_one_command_from_case_to_page(tmp_path, capsys):
    out = tmp_path / "run"
    words = ["run", CASE, "--out", str(out), "--quiet", "--set", "time.maximum=12", "--seeds", "2"]
    assert grainpair(words) == 0
    told = capsys.readouterr().out
    metrics = json.loads((out / "metrics.json").read_text())
    assert "verdict:" in told and metrics["scene"] == "chute" and "2 packings" in told
    assert metrics["solid_fraction"]["dem_std"] > 0.0
    for name in ("report.html", "profiles.csv", "figures/profiles.svg", "figures/start.png"):
        assert (out / name).stat().st_size > 0, name
    assert "run-out" not in (out / "report.html").read_text().lower()
    for side in (sides.of(out / "mpm.h5"), sides.of(out / "dem.h5")):
        assert 0.4 < side.flow.figures["solid_fraction"] < 0.65
        assert 0.4 < side.flow.figures["stress_ratio"] < 0.7
        assert side.flow.figures["normal_balance"] < 0.1


def test_a_chute_that_is_killed_goes_on_bit_for_bit(grains, tmp_path):
    """With the account of the slope, whose grains cross the seam."""
    path = tmp_path / "dem.h5"
    words = ["time.maximum=4.0", "dem.audit_interval=1", "time.frame_interval=0.5"]
    words += ["output.checkpoint_interval=0.01"]
    sets = [word for one in words for word in ("--set", one)]
    store = ["--packings", str(grains.with_name("packings")), "--quiet"]
    command = module("dem_reference.run", CASE, "-o", str(path), *sets, *store)
    process = subprocess.Popen(command, cwd=ROOT, stderr=subprocess.DEVNULL, start_new_session=True)
    kept = path.with_name("dem.h5.unfinished")
    while process.poll() is None and len(seen(kept, "checkpoint-*.h5")) < 2:
        time.sleep(0.01)
    killed = process.poll() is None
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    assert killed and not path.exists()
    assert subprocess.run(command, cwd=ROOT, check=False).returncode == 0
    told = ("@case", "@case_resolved")  # that tells how often it was kept
    assert [place for place in differences(path, grains) if place not in told] == []


def test_a_report_names_its_commands_without_folders(tmp_path):
    """And differences only of what a flow is; how much a balance is off by is none."""
    run: Any = SimpleNamespace(
        attributes={"command": "/a/b/mpm_run x.toml --seed 1 -o /c/d/mpm.h5"}
    )
    side = sides.Side(tmp_path / "mpm.h5", run, np.zeros(3), measured(bagnold_profile()))
    assert report.made_by(side) == "mpm_run x.toml --seed 1 -o mpm.h5"
    assert report.verdict(side, side).endswith("the continuum at 1.00 of the grains' mean velocity")
    assert set(report.STATE) < set(side.flow.figures)


def test_laws_are_judged_at_every_height_of_the_grains_flow(grains, tmp_path, capsys):
    """Of a chute there is one column of cells, with the friction of its profile; the controls are
    told apart, and a layer that stands is refused.
    """
    found = cells(steady.profile(grains, 1.0))
    flowing = found.where(found.flowing)
    assert len(flowing) > 3 and np.all(np.diff(flowing.y) > 0.0)
    assert flowing.coaxiality() > 0.9
    side = sides.of(grains).flow
    ratio = np.interp(flowing.y, side.y, side.columns["shear"] / side.columns["normal"])
    assert flowing.friction == pytest.approx(ratio, rel=0.25)  # of another kernel, and of sigma_yy
    for name in ("dem.h5", "dem_2.h5"):
        shutil.copy(grains, tmp_path / name)
    words = ["judge", str(tmp_path), "--laws", "mu_i", "drucker_prager", "--cards", "dem_mu05"]
    words += ["--widths", "1.0", "--quiet", "--out", str(tmp_path / "out")]
    assert grainpair(words) == 0
    told = capsys.readouterr().out
    assert told.count("control told apart") == 2 and "NOT" not in told
    assert (tmp_path / "out" / "depth.png").stat().st_size > 0
    with h5py.File(tmp_path / "dem.h5", "r+") as file:
        file.attrs["end_reason"] = np.bytes_("rest")
    assert grainpair(words) == 2
    assert "the layer stands (laws are judged in a flow)" in capsys.readouterr().err
    assert grainpair(["judge", "chute_ci", "--outcome", "--quiet"]) == 2
    assert "--outcome tells what collapses are off by" in capsys.readouterr().err


def layer(folder, *assignments) -> tuple[float, float]:
    """Of a flowing layer whose points began beside their places: its mean height over that of the
    start, after shear strains of some fifty, and the greatest share of volume without room.
    """
    words = [f"--set={one}" for one in ("mpm.jitter=0.3", *assignments)]
    done = subprocess.run(
        [
            program("mpm_run"),
            ROOT / "cases" / "chute_ci",
            "-o",
            folder / "mpm.h5",
            "--quiet",
            *words,
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    with h5py.File(folder / "mpm.h5") as run:
        frames = run["data"]
        heights = [
            float(np.mean(frames[name]["particles/cloud/position/y"]))
            for name in sorted(frames, key=int)
        ]
    warned = re.search(r"crowding: for (\d+) %", done.stderr)
    return heights[-1] / heights[0], float(warned.group(1)) / 100 if warned else 0.0


# Shear makes room: a layer that begins in order rises, by 8 % here. Begun in disorder it flows more
# slowly, and rises less; but unless volumes follow the room, it sinks into itself.
def test_a_layer_sheared_for_long_keeps_its_volume(tmp_path):
    in_order, none = layer(tmp_path, "mpm.jitter=0")
    followed, little = layer(tmp_path, "mpm.volume_relaxation=1")
    assert in_order > 1.06 and none == 0.0
    assert 1.0 < followed < in_order and little == 0.0
    sunk, warned = layer(tmp_path)  # the control
    assert sunk < 0.7 and warned > 0.1
