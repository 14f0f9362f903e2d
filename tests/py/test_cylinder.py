"""A column about an axis: both engines over radius and height, on one grid of rings."""

import json
import shutil
import subprocess
from dataclasses import replace

import h5py
import numpy as np
import pytest

from cases.errors import CaseError
from cases.programs import ROOT, module, program
from compare import __main__ as cli
from compare.mapping.runs import map_fields, open_fields, open_run
from compare.verdict.budget import mean_and_fluctuating
from compare.verdict.comparison import load

QUARTER = np.pi / 2
SMALL = (
    "geometry.height=0.016",
    "geometry.length=0.02",
    "geometry.floor_length=0.05",
    "dem.young_modulus=5e6",
    "mpm.cell_size=0.002",
    "time.maximum=1.2",
)


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """mpm.h5, dem.h5 and fields.h5 of a small cylinder."""
    folder = tmp_path_factory.mktemp("cylinder") / "pair"
    folder.mkdir()
    sets = [word for one in SMALL for word in ("--set", one)]
    grains = ["cases/cylinder", "-o", folder / "dem.h5", "--packings", folder.parent / "packings"]
    subprocess.run(module("dem_reference.run", *grains, *sets, "--quiet"), cwd=ROOT, check=True)
    words = [program("mpm_run"), "cases/cylinder", "-o", folder / "mpm.h5", *sets, "--quiet"]
    subprocess.run(list(map(str, words)), cwd=ROOT, check=True)
    map_fields([folder / "mpm.h5", folder / "dem.h5"], folder / "fields.h5")
    return folder


@pytest.fixture(scope="module")
def compared(pair):
    return load(pair)


def total(run, of) -> np.ndarray:
    return np.array([of(cloud) for cloud in run.clouds])


def test_rings_hold_what_the_quarter_holds(compared):
    """Mass and kinetic energy, which the density and the kinetic stress must add up to, frame by
    frame; in a plane of the same cells they would not.
    """
    for run in compared.first:
        grid = run.fields.grid
        assert grid.angle == pytest.approx(QUARTER)
        held = grid.integral(run.fields["density"]) * run.mass_scale
        assert held == pytest.approx(total(run, lambda c: c.mass.sum()) * run.mass_scale, rel=1e-9)
        flat = replace(grid, angle=0.0, cell_volume=grid.cell_volume.mean())
        assert flat.integral(run.fields["density"]) != pytest.approx(held, rel=0.1)


def test_kinetic_energy_is_that_of_the_mean_and_the_fluctuation(compared):
    for run in compared.first:
        mean, fluctuating = mean_and_fluctuating(run)
        kinetic = total(run, lambda c: 0.5 * (c.mass * (c.v**2).sum(axis=1)).sum())
        scale = run.mass_scale / run.reference_energy
        # fields are kept in single precision
        assert mean + fluctuating == pytest.approx(kinetic * scale, rel=1e-5, abs=1e-9)


def test_what_stands_carries_what_lies_above(compared):
    """At release, in every cell far from the rim and the floor's grains: the vertical stress over
    the area is the weight above it. A quarter stands about where its planes of symmetry are no
    walls: with their force among the walls' it would be no balance along the angle.
    """
    _, dem = compared.first
    grid, g = dem.fields.grid, dem.case["geometry.gravity"]
    area = grid.cell_volume / (grid.y[1] - grid.y[0])
    stress = dem.fields["contact_stress"][0][..., 1, 1]
    weight = (g * dem.fields["density"][0] * grid.cell_volume).sum(axis=1)
    above = np.cumsum(weight[::-1])[::-1] - 0.5 * weight  # of the cells' middles
    carried = (stress * area).sum(axis=1)
    rows = (grid.y > 0.004) & (grid.y < 0.010)
    assert carried[rows] == pytest.approx(above[rows], rel=0.05)
    # the control: the area of a plane
    flat = (stress * area.mean()).sum(axis=1)
    assert np.abs(flat[rows] / above[rows] - 1.0).min() > 0.05


def test_both_sides_are_compared(pair, tmp_path):
    out = tmp_path / "out"
    shutil.copytree(pair, out)
    assert cli.main(["compare", str(out), "--quiet"]) == 0
    metrics = json.loads((out / "metrics.json").read_text())
    # both are a quarter: what is left is the packing's own void ratio
    assert metrics["mass"]["mpm"] == pytest.approx(metrics["mass"]["dem"], rel=1e-12)
    voids = metrics["bulk_void_ratio"]
    assert voids["mpm"] == pytest.approx(voids["dem"], abs=0.05)
    # until 1.2 sqrt(H/g) both fall freely for the most part, whatever the law
    for name in ("centre_of_mass_x", "centre_of_mass_y"):
        one = metrics[name]
        assert one["mpm"] == pytest.approx(one["dem"], rel=0.15), name
    assert (out / "report.html").stat().st_size > 1e5


def test_a_radius_has_no_profile_and_no_depth(pair, tmp_path):
    for words in (("--dimension", "1"), ("--dimension", "3"), ("--range-z", "0", "0.01")):
        with pytest.raises(CaseError, match="over radius and height alone"):
            map_fields([pair / "dem.h5"], tmp_path / "fields.h5", *words)


def test_grains_of_another_program_about_an_axis_are_refused(pair, tmp_path):
    other = tmp_path / "grains.h5"
    other.write_bytes((pair / "dem.h5").read_bytes())
    with h5py.File(other, "a") as file:
        file.attrs["source"] = "a dump"
    with pytest.raises(CaseError, match="which sector is not told"):
        map_fields([other], tmp_path / "fields.h5")
    open_fields(pair / "fields.h5", "dem")
    open_run(pair / "dem.h5")
