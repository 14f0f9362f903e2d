"""Each check of a comparison sees what it is for, and is silent where all is well."""

import json
import re
import subprocess
import sys
from dataclasses import replace

import h5py
import numpy as np
import pytest
from synthetic import write_pair

from cases.programs import ROOT, program
from compare import __main__ as cli
from compare.mapping.contacts import base_friction, largest_overlap
from compare.mapping.reductions import example_run
from compare.mapping.runs import map_fields, open_run
from compare.metrics import all_metrics
from compare.report.charts.map_granular_temperature import map_granular_temperature
from compare.verdict import comparison, conclusion, findings
from compare.verdict.comparison import Comparison
from compare.verdict.findings import Severity, warned
from compare.verdict.findings.matter_at_end import SHARE

QUIET = {"time": [0.0, 1.0], "kinetic": [0.0, 0.0], "unaccounted": [0.0, 0.0]}


def seen(name, mpm=None, dem=None, metrics=None, **attributes) -> list[findings.Finding]:
    """What one check finds of a pair of runs made of arrays."""
    runs = [
        example_run(engine=engine, **({"energy": QUIET} | (words or {})))
        for engine, words in (("mpm", mpm), ("dem", dem))
    ]
    for run in runs:
        run.attributes |= attributes
    findings.all_checks()
    return findings.REGISTRY[name](Comparison(runs[:1], runs[1:]), metrics or {})


def one(found: list[findings.Finding]) -> findings.Finding:
    assert len(found) == 1
    return found[0]


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """A pair without a fault: (folder, comparison)."""
    folder = write_pair(tmp_path_factory.mktemp("good"), mpm={"frames": 6}, dem={"frames": 6})
    map_fields(sorted(folder.glob("*.h5")), folder / "fields.h5")
    c = comparison.load(folder)
    c.numerical_uncertainty = {"run_out_95": 0.0}
    return folder, c


def test_a_continuum_whose_numerical_error_is_unknown_is_noted(good):
    c = replace(good[1], numerical_uncertainty={})
    findings.all_checks()
    found = one(findings.REGISTRY["no_error_bar"](c, {}))
    assert found.severity == "note" and "numerics is unknown" in found.sentence
    found = one(findings.REGISTRY["no_error_bar"](replace(c, no_siblings="too fast"), {}))
    assert found.severity == "caution" and "(too fast)" in found.sentence


def test_a_good_pair_has_no_finding(good):
    metrics = conclusion.conclude(good[1], [])
    assert metrics["findings"]["list"] == [] and metrics["findings"]["value"] == "none"
    assert metrics["verdict"]["valid"] and conclusion.exit_code(metrics, []) == 0


def test_warnings_of_the_engines_are_told_everywhere(tmp_path, capsys):
    lines = (
        "noise: up to 28 % of the kinetic energy is in motion of points that their cell cannot "
        "see (lower mpm.relaxation_time)\nend: matter reached the far end\nwobble: something new"
    )
    folder = write_pair(
        tmp_path, mpm={"frames": 3, "attributes": {"warnings": lines}}, dem={"frames": 3}
    )
    assert cli.main(["compare", str(folder), "--quiet"]) == conclusion.INVALID == 4
    told = capsys.readouterr().out
    metrics = json.loads((folder / "metrics.json").read_text())
    page = (folder / "report.html").read_text()
    for word in ("noise", "end", "wobble"):
        assert f"warns, {word}" in told and f"warns, {word}" in page
    assert told.splitlines()[0].startswith(f"{folder}: verdict: INVALID")
    assert "<b>Invalid result</b>" in page and 'class="finding invalid"' in page
    assert page.index("<b>Invalid result</b>") < page.index("warns, noise") < page.index("<table")
    noise, end, wobble = (f for f in metrics["findings"]["list"] if f["name"] == "warned")
    assert (noise["severity"], noise["figure"], noise["bound"]) == ("invalid", 0.28, 0.02)
    assert noise["advice"] == "lower mpm.relaxation_time" and "watch" in noise["reason"]
    assert end["severity"] == "invalid" and wobble["severity"] == "caution"
    assert metrics["verdict"]["valid"] is False


def test_warnings_of_the_grains_are_told_too():
    found = seen("warned", warnings="none")
    assert found == []
    assert {f.of for f in seen("warned", warnings="tension: a point pulls with 0.5 of it")} == {
        "mpm",
        "dem",
    }


def test_bounds_of_warnings_are_the_watchs_own():
    source = (ROOT / "mpm" / "step" / "watch.cpp").read_text()
    for word, (bound, _) in warned.BOUNDS.items():
        name = word if word == "drift" else f"most_{'roughness' if word == 'locking' else word}"
        found = re.search(rf"constexpr double {name} = ([^;]+);", source)
        assert found, word
        a, _, b = found[1].partition("/")
        assert float(a) / float(b or 1.0) == pytest.approx(bound), word


@pytest.mark.parametrize("engine", ["mpm", "dem"])
@pytest.mark.parametrize(
    "place, reach", [((99.99, 0.5), "far end"), ((150.0, 0.5), "beyond"), ((1.0, -0.2), "below")]
)
def test_matter_at_the_end_of_the_scene(engine, place, reach):
    x = np.full((3, 1000, 3), 0.5)
    x[1, :3, :2] = place  # it is back at the end: what reached the end counts
    stray = one(seen("matter_at_end", **{engine: {"x": x, "time": (0.0, 0.5, 1.0)}}))
    assert (stray.severity, stray.of) == (Severity.CAUTION, engine)
    x[1, :83, :2] = place
    many = one(seen("matter_at_end", **{engine: {"x": x, "time": (0.0, 0.5, 1.0)}}))
    assert many.severity == Severity.INVALID and many.figure == pytest.approx(0.083)
    assert many.bound == SHARE and "floor_length" in many.advice


@pytest.mark.parametrize("engine", ["mpm", "dem"])
def test_matter_that_a_later_frame_lacks(engine):
    x = np.full((2, 100, 3), 0.5)
    run = example_run(engine=engine, x=x, time=(0.0, 1.0), energy=QUIET)
    whole = {"mpm": example_run(engine="mpm", energy=QUIET), "dem": example_run(energy=QUIET)}
    runs = whole | {engine: run}
    c = Comparison([runs["mpm"]], [runs["dem"]])
    findings.all_checks()
    assert findings.REGISTRY["matter_lost"](c, {}) == []
    cloud = run.clouds[1]
    run.clouds[1] = replace(cloud, x=cloud.x[:90], v=cloud.v[:90], mass=cloud.mass[:90])
    found = one(findings.REGISTRY["matter_lost"](c, {}))
    assert found.severity == Severity.INVALID and found.figure == pytest.approx(0.1)
    run.clouds[1] = replace(cloud, x=np.where(np.arange(100)[:, None] < 2, np.nan, cloud.x))
    assert "no place" in one(findings.REGISTRY["matter_lost"](c, {})).sentence


@pytest.mark.parametrize("engine", ["mpm", "dem"])
def test_energy_lost_and_energy_made(engine):
    def with_rest(*rest):
        time = np.arange(len(rest))
        return {engine: {"energy": {"time": time, "kinetic": 0 * time, "unaccounted": rest}}}

    assert seen("energy_lost", **with_rest(0.0, 0.049)) == []
    lost = one(seen("energy_lost", **with_rest(0.0, 0.108)))
    assert (lost.severity, lost.figure, lost.bound) == (Severity.INVALID, 0.108, 0.05)
    assert "margin_loss" in lost.reason
    assert seen("energy_created", **with_rest(0.0, 0.108)) == []
    made = one(seen("energy_created", **with_rest(0.0, -0.06, 0.0)))
    assert made.severity == Severity.INVALID and made.figure == pytest.approx(0.06)


def test_an_account_that_is_negative_is_energy_made_though_the_sum_is_not():
    energy = QUIET | {"loss_transfer": [0.0, 0.04], "loss_mixing": [0.0, -0.03]}
    assert one(seen("energy_created", mpm={"energy": energy})).figure == pytest.approx(0.03)


def test_a_run_that_did_not_come_to_rest():
    energy = QUIET | {"kinetic": [1.0, 0.04]}
    assert seen("still_moving", mpm={"energy": energy}, end_reason="rest") == []
    found = one(seen("still_moving", mpm={"energy": energy}, end_reason="maximum")[:1])
    assert found.severity == Severity.CAUTION and found.figure == pytest.approx(0.04)


@pytest.mark.parametrize(
    "scale, void_ratios, count",
    [(1.01, (0.70, 0.71), 0), (1.05, (0.70, 0.71), 1), (1.0, (0.70, 0.80), 1)],
)
def test_columns_that_are_packed_apart(scale, void_ratios, count):
    metrics = {
        "mass_scale": {"value": scale},
        "bulk_void_ratio": dict(zip(("mpm", "dem"), void_ratios)),
    }
    found = seen("columns_apart", metrics=metrics)
    assert [f.severity for f in found] == [Severity.CAUTION] * count


def test_points_that_move_without_stress():
    """Of whatever regime, 0 with a stress and 4 without one: any law is told by its stress."""
    run = example_run(engine="mpm", x=np.zeros((1, 10, 3)), v=np.ones((1, 10, 3)), energy=QUIET)
    c = Comparison([run], [])
    findings.all_checks()
    for free, count in ((1, 0), (5, 1)):
        none = np.arange(10) < free
        state = {"regime": np.where(none, 4, 0), "stress": np.where(none, 0.0, 1.0)}
        run.clouds[0] = replace(run.clouds[0], state=state)
        found = findings.REGISTRY["without_stress"](c, {})
        assert [f.severity for f in found] == [Severity.NOTE] * count
    assert found[0].figure == pytest.approx(0.5)


@pytest.mark.parametrize("overlap, count", [(0.01, 0), (0.04, 1)])
def test_grains_that_overlap(tmp_path, overlap, count):
    folder = write_pair(tmp_path, mpm={"frames": 2}, dem={"frames": 2})
    with h5py.File(folder / "dem.h5", "a") as f:
        contacts = f.create_group("data/100/contacts")
        contacts["first"], contacts["second"] = [1, 2, 3], [2, 3, -1]  # the last: with a wall
        for k, values in zip("xyz", np.eye(3) * [0.002 * (1.0 - overlap), 0.002, 1e-5]):
            contacts[f"branch/{k}"] = values
    run = open_run(folder / "dem.h5")
    assert largest_overlap(run) == pytest.approx(overlap)
    c = Comparison([open_run(folder / "mpm.h5")], [run])
    findings.all_checks()
    assert len(findings.REGISTRY["overlaps"](c, {})) == count


@pytest.mark.parametrize("friction, count", [(0.1, 1), (0.39, 0)])
def test_a_base_on_which_grains_roll(tmp_path, friction, count):
    folder = write_pair(tmp_path, mpm={"frames": 2}, dem={"frames": 2})
    with h5py.File(folder / "dem.h5", "a") as f:
        frame = f["data/100"]
        ids, speed = frame["particles/cloud/id"][:], frame["particles/cloud/velocity/x"]
        speed[:3] = [1.0, -1.0, 0.0]  # to either side, and at rest
        contacts = frame.create_group("contacts")
        contacts["first"], contacts["second"] = ids[:4], [-3, -3, -3, -1]  # the last: left wall
        forces = ([-friction, friction, 0.4, 5.0], [1.0, 1.0, 1.0, 0.0], [0.0] * 4)
        for k, values in zip("xyz", forces):
            contacts[f"force/{k}"] = values
    run = open_run(folder / "dem.h5")
    run.case.values["walls"] |= {"base": "coulomb", "base_friction": 0.4}
    assert base_friction(run) == pytest.approx(friction)
    c = Comparison([open_run(folder / "mpm.h5")], [run])
    findings.all_checks()
    check = findings.REGISTRY["base_rolls"]
    assert len(check(c, {})) == count
    run.case.values["walls"]["base"] = "glued"
    assert check(c, {}) == []


def test_a_law_without_granular_temperature_is_said_and_gets_no_black_panels(good):
    c = good[1]
    findings.all_checks()
    check = findings.REGISTRY["no_temperature"]
    figure, sentence = map_granular_temperature(c, False)
    both = len(figure.axes)
    assert check(c, {}) == [] and "stand alone" not in sentence
    fields = dict(c.mpm[0].fields.values)
    none = 0.0 * c.mpm[0].fields["granular_temperature_state"]
    fields["granular_temperature_state"] = none
    cold = replace(c.mpm[0], mapped=replace(c.mpm[0].fields, values=fields, loaded={}))
    c = Comparison([cold], c.dem)
    assert one(check(c, {})).severity == Severity.NOTE
    for narrow in (False, True):
        figure, sentence = map_granular_temperature(c, narrow)
        titles = [ax.get_title(loc="left") for ax in figure.axes]
        assert "the grains stand alone" in sentence
        assert not any(title.startswith("MPM") for title in titles)
        assert len(figure.axes) - 1 == (both - 1) // 2  # one is the bar of colours


def test_energies_without_an_audit():
    without = {"energy": {"time": [0.0, 1.0], "kinetic": [0.0, 0.0]}}
    open_balance = {"energy": QUIET | {"unaccounted": [np.nan, np.nan]}}
    for dem in (without, open_balance):
        assert one(seen("no_audit", dem=dem)).severity == Severity.CAUTION
    split = all_metrics()["dissipation_split"]
    mpm = example_run(engine="mpm", energy=QUIET | {"dissipated_regime_4": [0.0, 0.0]})
    assert np.isnan(split(mpm, example_run(energy=QUIET | {"dissipated": [0.0, 1.0]})))


def test_a_control_that_passes_is_a_caution():
    metrics = {"control_shuffled": {"value": "NOT REJECTED"}, "control_x": {"value": "rejected"}}
    found = one(seen("control_passed", metrics=metrics))
    assert found.severity == Severity.CAUTION and "shuffled" in found.sentence


@pytest.mark.parametrize(
    "changed, count",
    [
        ({}, 0),
        ({"run_out_95": -0.4, "run_out_height": 0.03}, 1),
        ({"run_out": -0.4, "centre_of_mass_x": 0.2}, 1),  # a neighbour: not the free surface
        ({"run_out_95": -0.01, "run_out_height": 0.01}, 0),  # neither beyond its margin
        ({"run_out_95": 0.4, "run_out_height": 0.3, "centre_of_mass_x": 0.1}, 0),
    ],
)
def test_figures_that_contradict_one_another(changed, count):
    names = ("run_out_95", "run_out_99", "run_out", "run_out_height", "centre_of_mass_x")
    metrics = {name: {"dem": 1.0, "difference": changed.get(name, 0.0)} for name in names}
    found = seen("contradiction", metrics=metrics)
    assert [f.severity for f in found] == [Severity.NOTE] * count


def test_a_law_of_losses_makes_energies_undecidable_and_the_verdict_follows(tmp_path):
    folder = write_pair(
        tmp_path, mpm={"frames": 3, "dissipated": 0.89}, dem={"frames": 3, "dissipated": 0.92}
    )
    map_fields(sorted(folder.glob("*.h5")), folder / "fields.h5")
    metrics = conclusion.conclude(comparison.load(folder), [])
    for name in ("dissipated_energy", "kinetic_energy_peak"):
        assert metrics[name]["verdict"] == "not decidable"
        assert metrics[name]["because"] == "11.0 % lost in the continuum's numerics"
    assert metrics["verdict"]["value"] == "not decidable"
    assert {f["of"] for f in metrics["findings"]["list"]} == {"mpm", "dem"}


def test_numerical_uncertainty_is_shown_and_weighed(good):
    c = replace(good[1], numerical_uncertainty={"run_out_95": 1.0, "wasserstein_x": 0.5})
    plain, wide = (
        comparison.evaluate(replace(c, numerical_uncertainty=by))
        for by in ({}, c.numerical_uncertainty)
    )
    assert plain["run_out_95"]["verdict"] == "within margin"
    for name, by in c.numerical_uncertainty.items():
        assert "numerical_uncertainty" not in plain[name]
        assert wide[name]["numerical_uncertainty"] == by
        assert wide[name]["verdict"] == "unresolved"


def test_required_verdicts_decide_the_exit_code(good, capsys):
    folder = str(good[0])
    words = ["compare", folder, "--quiet", "--require"]
    assert cli.main([*words, "run_out,final_height"]) == 0
    stem = good[0].parent / "other"
    other = write_pair(stem, mpm={"frames": 3, "stretch": 3.0}, dem={"frames": 3})
    assert cli.main(["compare", str(other), "--quiet"]) == 0  # a difference is a result
    assert cli.main(["compare", str(other), "--quiet", "--require", "run_out"]) == 5
    assert "run_out does not hold (outside margin)" in capsys.readouterr().err


@pytest.mark.parametrize("command", [["compare", "no/such/folder"], ["run", "column_ci"]])
@pytest.mark.parametrize("name", ["run_ot", "mass", "stop_time"])
def test_a_required_name_without_a_verdict_is_refused_before_anything_runs(
    command, name, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert cli.main([*command, "--require", f"final_height,{name}"]) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"--require: '{name}' gets no verdict") and "run_out" in told
    assert told.count("\n") == 1 and list(tmp_path.iterdir()) == []


def test_a_floor_that_is_too_short_spoils_a_real_run(tmp_path, capsys):
    """The smallest column on a floor of 30 mm: dammed as a continuum, fallen off as grains."""
    grains = [sys.executable, "-m", "dem_reference.run", "--quiet"]
    for engine, start in (("mpm", [str(program("mpm_run"))]), ("dem", grains)):
        scene = [str(ROOT / "cases" / "column_ci"), "--set", "geometry.floor_length=0.03"]
        command = [*start, *scene, "-o", str(tmp_path / f"{engine}.h5")]
        subprocess.run(command, check=True, capture_output=True, cwd=ROOT)
    assert cli.main(["compare", str(tmp_path), "--quiet"]) == 4
    told = " ".join(line.strip() for line in capsys.readouterr().out.splitlines())
    assert "verdict: INVALID" in told
    assert "has geometry.floor_length = 0.12, not 0.03" in told
    metrics = json.loads((tmp_path / "metrics.json").read_text())
    at_end = [f for f in metrics["findings"]["list"] if f["name"] == "matter_at_end"]
    assert {f["of"] for f in at_end if f["severity"] == "invalid"} == {"mpm", "dem"}
    assert next(f["figure"] for f in at_end if f["of"] == "dem") > 0.2
    page = (tmp_path / "report.html").read_text()
    assert page.count("reached the end of the scene") == 2 and "<b>Invalid result</b>" in page


@pytest.mark.parametrize("height, share", [(1e-3, 1.0), (0.02, 0.0)])
def test_temperature_of_a_layer_thinner_than_a_grain_is_noted(tmp_path, height, share):
    """All of it at one height, below or above the 2 mm of a grain."""
    folder = write_pair(tmp_path, mpm={"frames": 3}, dem={"frames": 3})
    with h5py.File(folder / "mpm.h5", "r+") as f:
        for frame in f["data"].values():
            cloud = frame["particles/cloud"]
            y = cloud["position/y"][()]
            hot = np.argmin(np.abs(y - height))
            y[hot] = height
            cloud["position/y"][...] = y
            cloud["granular_temperature"][...] = np.where(np.arange(len(y)) == hot, 1.0, 0.0)
        f["energy/fluctuation"][...] = 1.0
    map_fields(sorted(folder.glob("*.h5")), folder / "fields.h5")
    findings.all_checks()
    found = findings.REGISTRY["thin_temperature"](comparison.load(folder), {})
    assert [one.figure for one in found] == ([1.0] if share else [])
    assert all(one.severity == "note" for one in found)
