"""Recipes, signatures, fronts, boundaries, ladders; the smallest studies must still conclude so."""

import json
import math
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from cases import case, programs
from cases.errors import Warned
from cases.programs import ROOT
from compare.mapping.reductions import example_run
from compare.mapping.clouds import Cloud
from compare.mapping.runs import Run
from compare.metrics import all_metrics
from compare.study import (
    atlas,
    boundary,
    convergence,
    distance,
    failure,
    figures,
    frontier,
    keys,
    ladder,
    recipe,
    signature,
    sweep,
)
from compare.verdict import equivalence as verdict

CI = ROOT / "cases" / "column_ci"


def launch(*words) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-m", "compare", *map(str, words)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=900,
    )


def made_of(x, kinetic=(0.0, 1.0, 0.0)):
    """A signature of points at x, with the given kinetic energy at 0, 1, 2 sqrt(H/g)."""
    energy = {
        "time": [0.0, 1.0, 2.0],
        "kinetic": kinetic,
        "potential": [2.0, 1.5, 1.0],
        "dissipated": [0.0, 0.5, 1.0],
        "unaccounted": [0.0, 0.0, 0.0],
    }
    places = np.zeros((1, len(x), 3))
    places[0, :, 0] = x
    run = example_run(x=places, energy=energy)
    run.attributes |= {"steps": 10, "end_reason": "rest", "seed": 1}
    return signature.compact(run), run


def test_a_signature_gives_the_metrics_of_its_run():
    random = np.random.default_rng(1)
    (a, run), (b, other) = (
        made_of(random.gamma(3.0, size=5000), kinetic=(0.0, peak, 0.0)) for peak in (1.0, 2.0)
    )
    for name in ("run_out", "wasserstein_x", "kinetic_energy_distance"):
        metric = all_metrics()[name]
        runs, copies = [run, other], [signature.expand(one, run.case) for one in (a, b)]
        exact, kept = (
            metric(*group) if metric.of_pair else metric(group[0]) for group in (runs, copies)
        )
        assert kept == pytest.approx(
            exact, abs=2e-3 * 3.0
        )  # of the mean x, 3: a tenth of the mean distance of two quantiles


def test_the_mean_of_an_ensemble_lies_halfway():
    (a, run), (b, _) = made_of(np.linspace(0.0, 1.0, 100)), made_of(
        np.linspace(1.0, 2.0, 100), kinetic=(0.0, 3.0, 0.0)
    )
    middle = distance.mean([a, b], run.case)
    assert distance.errors(a, middle, run.case)["deposit"] == pytest.approx(0.5, rel=1e-3)
    assert max(middle["kinetic"]) == pytest.approx(2.0)


def test_series_are_every_combination_and_recipes_are_told_apart_by_what_the_engine_reads():
    series = {
        "name": "s",
        "engine": "mpm",
        "set": {"a.b": 1},
        "vary": {"c.d": [0.5, 1e-3], "e.f": ["x", True]},
    }
    sets = [one.sets for one in recipe.expand(series, 10.0)]
    assert sets == [
        ("a.b=1", "c.d=0.5", "e.f=x"),
        ("a.b=1", "c.d=0.5", "e.f=true"),
        ("a.b=1", "c.d=0.001", "e.f=x"),
        ("a.b=1", "c.d=0.001", "e.f=true"),
    ]
    scene = case.load(CI)

    def key(engine, *sets):
        return keys.key("compare.study.point", recipe.Recipe(engine, sets), scene)

    assert key("mpm") == key("mpm", "dem.audit_interval=7")
    assert key("dem") != key("dem", "dem.audit_interval=7")
    assert key("mpm", "mpm.cell_size=0.004") != key("mpm")
    assert key("mpm", "mpm.cell_size=0.001") == key("mpm")  # what the case says anyway


def test_the_front_holds_what_nothing_beats_in_both():
    assert frontier.front(
        np.array([1.0, 2.0, 3.0, 4.0]), np.array([0.5, 0.6, 0.2, 0.2])
    ).tolist() == [0, 2]


def test_a_boundary_is_bracketed_and_its_absence_said():
    runs, good, bad = boundary.bisect(
        lambda value: {"status": "ok" if value < 2.0 else "energy growth"}, 0.5, 8.0, 1.1
    )
    assert good < 2.0 <= bad and bad / good <= 1.1 and len(runs) == 7
    assert boundary.bisect(lambda value: {"status": "ok"}, 1.0, 4.0)[1:] == (4.0, math.inf)
    assert math.isnan(boundary.bisect(lambda value: {"status": "timeout"}, 1.0, 4.0)[1])


def test_a_ladder_stops_where_two_rungs_in_a_row_agree():
    rungs = [(str(i), recipe.Recipe("mpm")) for i in range(6)]

    def stop(words):
        words = iter(words)
        return ladder.climb(
            rungs,
            lambda group: [{"status": "ok"}] * len(group),
            lambda point: verdict.Verdict(next(words), 0.0, 0.0, 0.0),
        )[1]

    no, yes = verdict.DIFFER, verdict.AGREE
    assert stop([no, yes, no, yes, yes, yes]) == 3  # the lone agreement below was luck
    assert stop([no] * 5 + [yes]) == 5
    assert stop([no] * 6) is None


def test_figures_and_failures_that_a_study_may_name_are_those_there_are():
    keys = tomllib.loads((ROOT / "cases" / "study_schema.toml").read_text())
    expect = keys["atlas"]["keys"]["failure"]["keys"]["expect"]["choices"]
    assert set(expect) == {*failure.CLASSES.values(), failure.OTHER, *Warned}
    group = keys["convergence"]["keys"]["group"]["keys"]["change"]["keys"]
    run = checkerboard(n=20, amplitude=0.1)
    run.energy |= {name: np.zeros(3) for name in ("kinetic", *figures.ACCOUNTS)}
    run.energy |= {"time": np.arange(3.0), "potential": np.array([2.0, 1.0, 0.0])}
    run.attributes |= {"steps": 1, "cpu_seconds_engine": 1.0, "commit": "x"}
    numbers = {name for name, value in figures.figures(run).items() if not isinstance(value, str)}
    for entry in (keys["convergence"]["keys"]["at_most"], group["limits"], group["at_most"]):
        assert set(entry["choices"]) == numbers


def test_a_failed_run_is_a_point_and_a_finished_one_is_not_run_again(tmp_path):
    class Options:
        jobs, profile, quiet = 1, None, True

    scene = case.load(CI)
    recipes = [
        recipe.Recipe("mpm", ("mpm.time_step_fraction=5", "mpm.cell_size=0.005"), "test"),
        recipe.Recipe("mpm", ("mpm.cell_size=0.005", "time.maximum=0.5"), "test", timeout=30.0),
    ]
    points = sweep.run_recipes(scene, recipes, Options)
    assert (
        points[0]["status"]
        in ("energy growth", "energy drift", "ejected points", "inverted volume")
        and points[0]["message"]
    )
    assert points[1]["status"] == "ok"
    kept = programs.kept("studies", "points") / f"{points[1]['key']}.json"
    before = kept.stat().st_mtime_ns
    sweep.run_recipes(scene, recipes, Options)
    assert kept.stat().st_mtime_ns == before


@pytest.mark.parametrize(
    "words, said",
    [
        (["frontier", CI, "--ensemble", "/nowhere"], "no run <seed>.h5"),
        (["frontier", "cases/shear"], ""),
        (["ladder", CI, "--tolerance", "200%"], "not a share"),
        (["ladder", CI, "--reference", ROOT / "README.md"], "not a reference"),
    ],
)
def test_bad_input_is_one_line(words, said):
    result = launch(*words)
    assert result.returncode == 2 and result.stderr.count("\n") == 1 and said in result.stderr


@pytest.mark.parametrize(
    "command, change, said",
    [
        ("frontier", ("engine =", "engin ="), ":8: unknown key 'frontier.series.engin'"),
        (
            "frontier",
            ("[[frontier.series]]", "[[frontier.serie]]"),
            ":6: unknown key 'frontier.serie'",
        ),
        ("frontier", ("mpm.cell_size", "mpm.cellsize"), ":10: unknown key 'mpm.cellsize'"),
        (
            "atlas",
            ('"energy growth"', '"energy groth"'),
            "unknown atlas.failure.expect 'energy groth'",
        ),
        ("convergence", ("[convergence]", "[convergense]"), "unknown table 'convergense'"),
        (
            "ladder",
            ("[frontier]", "[ladder]\ntimeout = 1.0\n[frontier]"),
            ":3: missing key 'ladder.rung'",
        ),
    ],
)
def test_a_slip_in_a_study_is_one_line_with_its_place(tmp_path, command, change, said):
    text = (CI / "study.toml").read_text()
    assert change[0] in text
    (tmp_path / "study.toml").write_text(text.replace(change[0], change[1], 1))
    (tmp_path / "case.toml").write_text(f'extends = "{CI / "case.toml"}"\n')
    result = launch(command, tmp_path)
    assert result.returncode == 2 and result.stderr.count("\n") == 1
    assert result.stderr.startswith(f"{tmp_path / 'study.toml'}:") and said in result.stderr


@pytest.fixture(scope="module")
def small_frontier(tmp_path_factory):
    out = tmp_path_factory.mktemp("frontier")
    result = launch(
        "frontier", "column_ci", "--reference", CI / "reference" / "grains.json", "--out", out
    )
    assert result.returncode == 0, result.stderr
    return out, pd.read_csv(out / "points.csv", comment="#")


def test_the_frontier_of_the_smallest_column_says_what_it_said(small_frontier):
    """On a coarse grid the simple law is as near the grains as the dearer one, within their
    scatter, and cheaper than that on a finer one; PIC pays more for more than twice the error; too
    large a step fails. Two runs of a fifth of a second each are not told apart by their time.
    """
    _, points = small_frontier
    grains = json.loads((CI / "reference" / "grains.json").read_text())
    plain = points[points["series"] == "law and cell size"].set_index(["law", "cell_size"])
    simple, dear, default = (
        plain.loc[key] for key in (("mu_i", 0.004), ("lade_duncan", 0.004), ("lade_duncan", 0.002))
    )
    pic = points[points["transfer"] == "pic"].iloc[0]
    assert simple["error_deposit"] < dear["error_deposit"] + frontier.band(grains, "deposit")
    assert simple["cost"] < default["cost"]
    assert pic["error_deposit"] > 2.0 * max(default["error_deposit"], dear["error_deposit"])
    assert points.loc[points["time_step_fraction"] == 5.0, "status"].item() != "ok"


def test_each_point_of_the_page_tells_its_recipe_and_command(small_frontier):
    out, points = small_frontier
    page = (out / "frontier.html").read_text()
    assert all(command in page for command in points["command"]) and page.count(
        "<title>MPM, "
    ) >= len(points)
    assert (
        "<script" not in page
        and "src=" not in page
        and (out / "frontier_deposit.png").stat().st_size > 10_000
    )


def test_named_failures_are_detected_and_absent_at_the_defaults():
    """Those that take a second; the whole table is in cases/column_ci/reference/atlas."""

    class Options:
        jobs, profile, quiet = 2, None, True

    scene = case.load(CI)
    quick = [
        one
        for one in recipe.study(scene, "atlas")["failure"]
        if one["name"] in ("FLIP noise", "volumetric locking", "step beyond the limit")
    ]
    pairs = [atlas.recipes_of(one, 60.0) for one in quick]
    points = sweep.run_recipes(scene, [one for pair in pairs for one in pair], Options)
    table = atlas.failure_table(quick, list(zip(points[::2], points[1::2])), scene)
    assert table["reproduced"].all() and table["absent_at_defaults"].all(), table.to_string()


def test_the_claimed_limit_and_twice_the_default_step_are_stable():
    """One row of the map: if the boundary came to lie below either, the atlas would say the
    opposite of what it says.
    """
    plane = recipe.study(case.load(CI), "atlas")["plane"][0] | {"values": [0.004]}
    ((_, task),) = atlas.rows_of(plane, 60.0)
    classify = boundary.runs_of(Path(CI), task)
    assert classify(1.0)["status"] == "ok" and classify(5.0)["status"] != "ok"


def test_the_ladder_of_the_smallest_column_stops_on_a_cheap_rung(tmp_path):
    result = launch(
        "ladder",
        "column_ci",
        "--tolerance",
        "15%",
        "--reference",
        CI / "reference" / "grains.json",
        "--out",
        tmp_path,
    )
    assert result.returncode == 0, result.stderr
    rungs = pd.read_csv(tmp_path / "ladder.csv", comment="#")
    assert (
        rungs["enough"].sum() == 1
        and rungs["enough"].idxmax() < 4
        and ("times cheaper" in result.stdout or "too short a run" in result.stdout)
    )


def test_a_change_is_judged_against_the_scatter_of_its_group():
    study = {
        "timeout": 1.0,
        "at_most": {"loss": 0.1},
        "group": [
            {
                "name": "g",
                "runs": 3,
                "change": [
                    {"name": "same", "limits": {"run_out": 0.05}},
                    {"name": "longer", "limits": {"run_out": 0.05}},
                    {"name": "rougher", "limits": {"run_out": 0.05}},
                ],
            }
        ],
    }
    settings = convergence.plan(study)
    assert [len(setting["recipes"]) for setting in settings] == [3] * 4
    assert {one.seed for one in settings[0]["recipes"]} == {1, 2, 3} and settings[0]["recipes"][0][
        "mpm.jitter"
    ] == "1e-10"
    run_outs = [[2.00, 2.01, 1.99], [2.01, 2.00, 2.02], [2.30, 2.29, 2.31], [1.7, 2.0, 2.3]]
    found = [
        [
            {
                "run_out": value,
                "loss": 0.2 if setting["name"] == "longer" else 0.05,
                "solver": "abc",
            }
            for value in values
        ]
        for setting, values in zip(settings, run_outs)
    ]
    table = convergence.table(settings, found).set_index(["setting", "figure"])
    assert list(table["verdict"].xs("run_out", level="figure")[1:]) == [
        "agree",
        "differ",
        "unresolved",
    ]
    assert table["change"]["longer", "run_out"] == pytest.approx(0.15)
    assert (
        table["verdict"]["longer", "loss"] == convergence.MORE
        and table["verdict"]["same", "loss"] == convergence.LESS
    )


def test_roughness_is_that_of_an_alternating_pressure_of_which_nodes_feel_little():
    # Along one axis, points at a quarter and three quarters of a cell give a node 11/16 of its own
    # cell and 5/32 of each neighbour, and take as much back: (11/16 - 10/32)^2 = 9/64 of what
    # alternates is left; along two, its square, 2 %. At walls a node has one neighbour, and more is
    # left.
    cells, nodes = figures.pressure_roughness(checkerboard(n=20, amplitude=0.1))
    assert cells == pytest.approx(0.1, rel=0.03)  # less what a cubic follows on 400 cells
    assert (9 / 64) ** 2 < nodes / cells < 0.06


def checkerboard(n, amplitude):
    """n x n cells of four points, pressure 1 +- amplitude alternating from cell to cell."""
    scene = case.load(CI)
    h = scene["mpm.cell_size"]
    index = np.arange(2 * n)
    i, j = (a.ravel() for a in np.meshgrid(index, index))
    x = np.stack([(i + 0.5) * h / 2, (j + 0.5) * h / 2, 0 * i], axis=1)
    pressure = 1.0 + amplitude * (-1.0) ** (i // 2 + j // 2)
    solid = np.ones(len(x))
    cloud = Cloud(x, 0 * x, solid, solid, {"pressure": pressure, "void_ratio": 0.7 * solid})
    fields = example_run(solid_fraction=np.full((1, 2, 2), 0.5)).mapped
    return Run("mpm", "mpm", scene, np.array([0.0]), [cloud], {}, {}, fields)


def test_halving_the_step_changes_nothing_and_pic_everything(tmp_path):
    done = launch("convergence", CI, "--jobs", 2, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    table = pd.read_csv(tmp_path / "convergence.csv", comment="#").set_index(["setting", "figure"])
    assert table["verdict"]["steps half as long", "run_out_99"] != verdict.DIFFER
    assert table["verdict"]["PIC", "run_out_99"] == verdict.DIFFER
    assert (
        table["verdict"]["as it is", "loss"] == convergence.LESS
        and table["verdict"]["PIC", "loss"] == convergence.MORE
    )
    assert (tmp_path / "convergence.png").stat().st_size > 10_000
