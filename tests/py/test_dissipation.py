"""Dissipation in place and time, and how far two of it are apart."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cases.case import load
from cases.programs import ROOT, call, program
from compare.mapping import dissipation
from compare.mapping.reductions import example_run
from compare.mapping.runs import open_run
from compare.metrics import all_metrics
from compare.study import distance, reference, signature
from compare.study.signature import packed, unpacked

CI = ROOT / "cases" / "column_ci"
TIMES = np.arange(0.0, 4.01, 0.2)


def flow(shift=(0.0, 0.0, 0.0), factor=1.0, **words):
    """A run of 2000 points that stand still; each dissipates most at a time of its own, up to
    4 sqrt(H/g). Shifted by (x, y, t).
    """
    random = np.random.default_rng(1)
    x = random.uniform([0.0, 0.2, 0.0], [2.0, 1.0, 0.0], (2000, 3))
    at = random.uniform(1.0, 2.0, 2000) + shift[2]
    gone = factor / (1.0 + np.exp((at - TIMES[:, None]) / 0.1)) / 2000
    gone -= gone[0]
    return example_run(
        x=np.tile(x + [shift[0], shift[1], 0.0], (len(TIMES), 1, 1)),
        time=TIMES,
        state={"dissipated": gone},
        **words,
    )


def placed(run) -> dissipation.InPlace:
    found = dissipation.in_place(run)
    assert found is not None
    return found


def apart(a, b) -> float:
    return all_metrics()["dissipation_distance"](a, b)


@pytest.mark.parametrize("axis", range(3))
def test_a_shift_gives_its_length_in_place_as_in_time(axis):
    # within a twentieth of a cell, 0.2: what the boundaries of cells take differs from place to
    # place, and 2000 points average over it
    for length in (0.03, 0.1, 0.3):
        shift = np.eye(3)[axis] * length
        assert apart(flow(shift), flow()) == pytest.approx(length, abs=0.01)


def test_what_is_missing_costs_as_if_moved_by_one():
    assert apart(flow(factor=0.9), flow()) == pytest.approx(0.1, abs=1e-9)
    assert apart(flow(factor=1.2), flow()) == pytest.approx(0.2, abs=1e-9)
    assert apart(replace(flow(factor=0.9), mass_scale=1.0 / 0.9), flow()) == pytest.approx(0.0)


def test_equal_sums_along_every_axis_do_not_hide_a_difference():
    """Early in front and late behind, or the other way round: alike in x alone and in t alone."""

    def corners(places):
        joules = np.full(len(places), 0.5)
        found = replace(flow(), dissipation=dissipation.InPlace(np.array(places), joules))
        return found

    one, other = corners([[0, 0, 0], [5, 0, 5]]), corners([[0, 0, 5], [5, 0, 0]])
    # either half has to go 5 cells of 0.2
    assert 0.5 < apart(one, other) < 1.0


def test_dissipation_between_frames_is_spread_over_the_time_between():
    cells, joules = dissipation.spread(np.array([[0.1, 0.1]]), np.array([1.0]), 0.3, 0.7)
    assert cells.tolist() == [[0, 0, 1], [0, 0, 2], [0, 0, 3]]
    assert joules == pytest.approx([0.25, 0.5, 0.25])


def test_what_walls_dissipate_is_booked_along_the_floor_and_only_for_the_continuum():
    history = {"time": [0.0, 4.0], "dissipated_wall": [0.0, 1.0]}
    x = np.tile([[0.5, 0.1, 0.0], [0.5, 0.9, 0.0]], (len(TIMES), 1, 1))
    state = {"dissipated": np.zeros((len(TIMES), 2))}
    grains, found = (
        placed(example_run(engine=name, x=x, v=x, time=TIMES, energy=history, state=state))
        for name in ("dem", "mpm")
    )
    assert found.total == pytest.approx(1.0)
    assert set(found.cells[found.joules > 0.0][:, 1]) == {0}
    assert grains.total == 0.0


def test_runs_that_do_not_tell_where_they_dissipate_have_no_distance():
    silent = example_run(x=np.zeros((2, 1, 3)), time=(0.0, 1.0))
    assert np.isnan(apart(silent, flow())) and np.isnan(apart(flow(), silent))
    assert np.isnan(apart(flow(), flow(factor=0.0)))


def test_a_signature_keeps_it_in_few_characters():
    whole = placed(flow(factor=3.0))
    kept = unpacked(json.loads(json.dumps(packed(whole))))
    assert kept.total == pytest.approx(whole.total, rel=5e-6)  # six digits
    copy = replace(flow(), dissipation=kept)
    assert apart(copy, flow(factor=3.0)) < 2e-3  # shares are rounded to 1e-5, of some 500 cells
    assert len(json.dumps(packed(whole))) < 12 * len(whole.joules)


def test_run_out_by_95_percent_is_read_at_the_level_of_a_signature_above_it():
    x = np.random.default_rng(1).gamma(3.0, size=5000)
    run = example_run(x=np.stack([x, 0 * x, 0 * x], axis=1)[None], energy={"time": [0.0, 1.0]})
    run.attributes |= {"steps": 1, "seed": 1, "end_reason": "rest"}
    kept = all_metrics()["run_out_95"](signature.expand(signature.compact(run), run.case))
    assert kept == pytest.approx(np.quantile(x, 487 / 512) - 1.0, abs=0.01)  # 4 digits, two points


def test_the_mean_of_runs_is_that_of_every_cell():
    one, other = (placed(flow(factor=f)) for f in (1.0, 2.0))
    middle = dissipation.mean([one, other])
    assert middle.joules == pytest.approx(1.5 * one.joules)
    assert middle.cells.tolist() == one.cells.tolist()


def test_grains_kept_without_it_leave_its_error_out_and_say_so():
    scene = load(CI)
    grains = reference.read(CI / "reference" / "grains.json", scene)
    members = [
        {name: value for name, value in one.items() if name != "dissipation"}
        for one in grains["members"]
    ]
    old = {"scatter": reference.scatter(members, scene)}
    assert "make them again" in reference.unknown(old, "dissipation")
    assert reference.unknown(old, "combined") and not reference.unknown(old, "deposit")
    found = distance.errors(members[0], distance.mean(members[1:], scene), scene)
    assert np.isnan([found["dissipation"], found["combined"]]).all() and found["deposit"] > 0.0


def test_an_ensembles_members_are_apart_by_less_than_a_law_may_be():
    """Signatures through and through: a packing against the mean of others, and a flow that is half
    a time scale late.
    """
    scene = load(CI)
    base = reference.read(CI / "reference" / "grains.json", scene)["members"][0]

    def signed(*shift):
        return base | {"dissipation": packed(placed(flow(shift)).times(1e-4))}

    middle = distance.mean([signed(0.05, 0, 0), signed(-0.05, 0, 0)], scene)
    near, far = (distance.errors(signed(*s), middle, scene) for s in ((0, 0, 0), (0, 0, 0.5)))
    assert near["dissipation"] < 0.02 and far["dissipation"] == pytest.approx(0.5, abs=0.02)
    assert far["combined"] == pytest.approx(0.25, abs=0.01)  # the other three are of the same run


def test_points_tell_all_accounts_of_a_law(tmp_path):
    """Of a law with enduring contacts too: the points' sum is the ledger's, to the single precision
    in which frames keep them, and is not without the account of the contacts.
    """
    path = tmp_path / "mpm.h5"
    words = ["material.law=contact_share", "material.card=contact_mu05", "mpm.cell_size=0.002"]
    sets = [word for one in (*words, "time.maximum=1.2") for word in ("--set", one)]
    done = call([program("mpm_run"), ROOT / "cases" / "column_ci", *sets, "-o", path, "--quiet"])
    assert done.returncode == 0, done.stderr
    run = open_run(path)
    cloud = run.clouds[-1]
    kinds = ("plastic", "regime_4", "contact")
    accounts = {kind: run.energy[f"dissipated_{kind}"][-1] for kind in kinds}
    assert cloud.state["dissipated"].sum() == pytest.approx(sum(accounts.values()), rel=1e-5)
    assert accounts["contact"] > 0.01 * sum(accounts.values())
