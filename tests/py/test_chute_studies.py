"""Studies of a chute: the ladder against the grains' steady flow, packings, thresholds."""

import numpy as np
import pandas as pd
import pytest

from bagnold import D, NU, bagnold_profile, measured
from cases.case import load
from cases.programs import ROOT
from compare.__main__ import main as grainpair
from compare.chute import study, thresholds
from compare.chute.signature import STEADY_FLOW
from compare.study import ladder
from compare.study.recipe import Recipe

CHUTE = load(ROOT / "cases" / "chute_ci")


def test_thresholds_lie_between_what_stands_and_what_flows():
    rows = [("dem", "rest", 22.0, "stopped"), ("dem", "rest", 23.0, "steady")]
    rows += [("dem", "0.3 m/s", 20.0, "stopped"), ("dem", "0.3 m/s", 21.0, "slows down")]
    table = pd.DataFrame(rows, columns=["engine", "begins", "inclination", "state"])
    assert thresholds.angles(table, "dem") == {"start": (22.0, 23.0), "stop": (20.0, 21.0)}
    assert thresholds.angles(table[table["state"] != "stopped"], "dem") == {
        "start": (-np.inf, 23.0),
        "stop": (-np.inf, 21.0),
    }


def test_packings_are_averaged_and_the_worst_balance_kept():
    rows = [
        {"engine": "dem", "state": "steady"}
        | dict.fromkeys((*study.SCATTERED, *study.WORST), value)
        for value in (1.0, 2.0, 3.0)
    ]
    found = study.over_packings(rows)
    assert found["bagnold"] == 2.0 and found["bagnold_deviation"] == 1.0
    assert found["shear_balance"] == 3.0 and found["packings"] == 3
    rows[1]["state"] = "speeds up"
    assert study.over_packings(rows)["state"] == "speeds up or steady"


def signature(fast: float = 1.0, state: str = "steady", nu: float = NU) -> dict:
    """Of a flow with Bagnold's profile, `fast` times as fast as another, and as hot."""
    one = measured(bagnold_profile())
    there = one.columns["solid_fraction"] > 0.0
    figures = one.figures | {"mean_velocity": fast * one.figures["mean_velocity"]}
    figures["solid_fraction"] = nu * figures["solid_fraction"] / NU
    return {
        "state": state,
        "y": (one.y[there] / D).tolist(),
        "solid_fraction": one.columns["solid_fraction"][there].tolist(),
        "velocity": (fast * one.columns["velocity"][there]).tolist(),
        "temperature": (fast**2 * one.columns["temperature"][there]).tolist(),
        "figures": figures,
    }


def test_errors_of_a_steady_flow_are_those_that_were_put_in():
    reference = STEADY_FLOW.mean([signature(0.98), signature(1.02)], CHUTE)
    found = STEADY_FLOW.errors(signature(0.7, nu=0.9 * NU), reference, CHUTE)
    assert found["velocity"] == pytest.approx(0.3, abs=1e-3)
    assert found["mean_velocity"] == pytest.approx(0.3, abs=1e-3)
    assert found["solid_fraction"] == pytest.approx(0.1, abs=1e-3)
    assert found["temperature"] == pytest.approx(1.0 - 0.7**2, abs=2e-3)
    assert STEADY_FLOW.errors(signature(), reference, CHUTE)["velocity"] < 1e-3


def test_a_flow_that_is_not_steady_is_held_against_nothing():
    """Negative controls of the ladder: one that speeds up has no errors, and its rung says so; one
    that is 30 % slow differs within 5 %.
    """
    members = [signature(0.98), signature(1.0), signature(1.02)]
    grains = {"members": members, "mean": STEADY_FLOW.mean(members, CHUTE)}
    points = [{"status": "ok"} | one for one in (signature(1.0, "speeds up"), signature(0.7))]
    points.append({"status": "ok"} | signature(1.001))
    rungs = [(name, Recipe("mpm")) for name in ("unsteady", "slow", "right")]
    tried, stop = ladder.climb(
        rungs,
        lambda some: points[: len(some)],
        lambda point: ladder.judge(point, grains, "velocity", 0.05, CHUTE, STEADY_FLOW),
    )
    assert [one["word"] for one in tried] == ["speeds up", "differ", "agree"] and stop == 2
    assert STEADY_FLOW.mean([members[0], signature(1.0, "slows down")], CHUTE)["state"] != "steady"


def test_a_ladder_of_a_chute_is_of_its_steady_flow(tmp_path, capsys):
    """Two rungs against the grains that are kept: neither comes up to them within a tenth, both
    come within all of it; what a deposit is judged by is refused, and so are grains that still
    speed up.
    """
    chute = ROOT / "cases" / "chute"
    (tmp_path / "case.toml").write_text(
        f'extends = "{chute / "case.toml"}"\n[geometry]\nlength = 0.02\n'
    )
    rungs = (chute / "study.toml").read_text().split("[[ladder.rung]]")
    (tmp_path / "study.toml").write_text("[[ladder.rung]]".join([rungs[0], rungs[2], rungs[7]]))
    words = ["ladder", str(tmp_path), "--reference", str(chute / "reference/grains.json")]
    words += ["--quiet", "--out", str(tmp_path / "out")]
    assert grainpair(words) == 0
    told = capsys.readouterr().out
    assert "No rung agrees" in told and "velocity over the depth" in told
    assert "differ" in (tmp_path / "out" / "ladder.csv").read_text()
    assert grainpair([*words, "--tolerance", "60%"]) == 0
    assert "Enough: mu(I)" in capsys.readouterr().out
    assert grainpair([*words, "--metric", "deposit"]) == 2
    assert "--metric deposit: no error of this kind of scene" in capsys.readouterr().err
    assert grainpair(["ladder", "column_ci", "--metric", "velocity"]) == 2
    assert "no error of this kind" in capsys.readouterr().err
