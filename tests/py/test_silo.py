"""A silo: what is refused of its case, its walls, its discharge, and the two engines beside each
other.
"""

import subprocess

import numpy as np
import pytest

from cases import case
from cases.errors import CaseError
from cases.programs import ROOT, module, program
from compare.mapping.runs import open_run
from compare.metrics.discharge import below, discharge
from compare.study import experiment, published, recipe
from dem_reference import packing, plates
from dem_reference.collapse import Column
from dem_reference.grains import Grains

SCENE = ROOT / "cases" / "silo_ci"


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """Result files of the continuum and of the grains, all contacts sampled."""
    folder = tmp_path_factory.mktemp("silo")
    mpm, dem = folder / "mpm.h5", folder / "dem.h5"
    subprocess.run([program("mpm_run"), SCENE, "-o", mpm, "--quiet"], check=True)
    words = [SCENE, "-o", dem, "--quiet", "--packings", folder, "--set", "dem.audit_interval=1"]
    subprocess.run(module("dem_reference.run", *words), check=True)
    return open_run(mpm), open_run(dem)


@pytest.mark.parametrize(
    "key, said",
    [
        ("geometry.orifice=0.024", "it would have no bottom"),
        ("walls.base=glued", "bottom and the floor below are plates"),
        ("walls.gate=lifted", "its wall stays"),
        ("walls.front_back=smooth", "span a period"),
        ("initial.state=packing", "no packing in a silo"),
        ("geometry.dimension=axisymmetric", "is a slot"),
    ],
)
def test_what_a_silo_cannot_have_is_refused(key, said):
    with pytest.raises(CaseError, match=said):
        case.load(SCENE, [key])


def test_only_a_silo_has_an_orifice():
    with pytest.raises(CaseError, match="only a silo has it"):
        case.load(ROOT / "cases" / "column_ci", ["geometry.orifice=0.005"])
    with pytest.raises(CaseError, match="geometry.orifice"):
        case.load(ROOT / "cases" / "column_ci", ["geometry.scene=silo", "walls.base=coulomb"])


def test_its_walls_end_where_they_should(tmp_path):
    scene = case.load(SCENE).values
    said = plates.silo(scene, Grains.of(scene), tmp_path)
    assert said.count("mesh/surface") == 2
    places = {
        name: np.array(
            [
                [float(word) for word in line.split()[1:]]
                for line in (tmp_path / f"{name}.stl").read_text().splitlines()
                if line.startswith("vertex")
            ]
        )
        for name in ("bottom", "side")
    }
    low, high = places["bottom"].min(axis=0), places["bottom"].max(axis=0)
    assert low == pytest.approx([0.008, 0.03, 0.0]) and high == pytest.approx([0.024, 0.03, 0.006])
    low, high = places["side"].min(axis=0), places["side"].max(axis=0)
    assert low == pytest.approx([0.024, 0.03, 0.0]) and high[1] > 0.06
    walls = {one.code: one for one in plates.standing(scene, Grains.of(scene))}
    assert walls[-6].begin == 0.008 and walls[-6].friction == 0.5 and walls[-2].lowest == 0.03


def test_nothing_passes_the_bottom_or_the_wall(pair):
    """Through the slot alone: what is lower than the bottom has been above it last in the slot."""
    for run in pair:
        reach = 0.5 * run.diameter if run.engine == "dem" else run.case["mpm.cell_size"]
        bottom = 0.03 if run.engine == "dem" else 0.031  # half-way between two nodes
        assert (run.clouds[0].x[:, 1] > bottom).all()
        for cloud in run.clouds:
            there = cloud.x
            high = there[:, 1] > bottom + reach
            assert (there[high, 0] < 0.024 + 1e-3 * run.diameter).all()
            # right below the bottom, beside the slot, is nobody that has come through it
            beside = (there[:, 0] > 0.008 + 2.0 * reach) & (there[:, 0] < 0.024)
            under = (there[:, 1] < bottom - 0.5 * reach) & (there[:, 1] > bottom - 1.5 * reach)
            assert not (beside & under).any()


def test_the_grains_energies_close_with_every_step_sampled(pair):
    """To 0.1 % of what falling sets free; without the walls' part they do not."""
    _, grains = pair
    free = grains.joules("potential")[0] - grains.joules("potential").min()
    open_ = abs(grains.joules("unaccounted"))
    assert open_.max() < 1e-3 * free
    assert (open_ + grains.joules("dissipated_wall")).max() > 2e-3 * free


def test_the_forces_of_its_walls_are_the_engines(tmp_path, monkeypatch):
    """Every force on every grain is one that is rebuilt, after the release: to a millionth of a
    grain's weight. Without the bottom among the walls it is not.
    """
    told = packing.dict_of(case.load(SCENE))
    made = packing.obtain(told, 1, tmp_path, lambda *_: None)
    monkeypatch.chdir(tmp_path)
    column = Column(told, made, tmp_path / "log")
    weight = column.grains.mass * 9.81

    def worst(steps) -> float:
        found = 0.0
        for step in steps:
            column.engine.reach(step)
            found = max(found, column.look(step * column.plan.dt).held.force_error)
        return found

    assert worst(range(10, 2000, 10)) < 1e-6 * weight
    column.walls = [one for one in column.walls if one.code != -6]
    assert worst([2000]) > weight


def test_all_leaves_by_the_slot_at_a_steady_rate(pair):
    """The share that has left grows in proportion to time: over the steady part a line explains all
    but a hundredth of its variance. In 147 grains nothing more can be asked.
    """
    for run in pair:
        left = np.array([below(cloud, 0.03) for cloud in run.clouds])
        assert left[0] == 0.0 and (np.diff(left) > -1e-2 * left[-1]).all()
        steady = (left >= 0.15 * left[-1]) & (left <= 0.75 * left[-1])
        fit = np.polyfit(run.time[steady], left[steady], 1)
        rest = left[steady] - np.polyval(fit, run.time[steady])
        assert rest.var() < 0.02 * left[steady].var()


def test_grains_leave_more_slowly_than_the_continuum(pair):
    """A slot of eight grains is narrower for grains than it is wide, by Beverloo's 1.4 of them and
    by what the wall in its middle takes; the continuum knows neither.
    """
    (law,) = published.read("silo")
    known, (mpm, dem) = law.at("discharge", 8.0), (discharge(run) for run in pair)
    assert known and 0.5 * known < dem < known < mpm


def test_beverloo_of_a_slot():
    (law,) = published.read("silo")
    assert law.at("discharge", 12.0) == pytest.approx(1.03 * (1.0 - 1.4 / 12.0) ** 1.5)
    assert law.at("discharge", 2.0) is None


def test_slots_of_a_study():
    scene = case.load(ROOT / "cases" / "silo")
    columns = experiment.plan(scene, recipe.study(scene, "experiment"))
    for one in columns:
        assert float(str(one.mpm["geometry.orifice"])) == pytest.approx(one.place * 0.001)
    with pytest.raises(CaseError, match="has no slots"):
        experiment.plan(scene, {"aspect_ratios": [1.0], "packings": 1, "timeout": 1.0})
