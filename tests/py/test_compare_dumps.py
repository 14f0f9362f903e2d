"""Grains of other people's runs against a continuum: compared like any other, and what they do not
tell is absent.
"""

import json

import matplotlib.pyplot as plt
import numpy as np
import pytest
from foreign_block import DT, SCENE, SIZES, D, grains, imported, write
from synthetic import write_run

from cases import case
from compare import __main__ as cli
from compare.mapping.runs import map_fields, open_run
from compare.report.charts import all_charts
from compare.verdict import comparison, conclusion, findings


def compared(folder, *files, **more):
    """The comparison of imported grains with a continuum of formulas."""
    write_run(folder / "mpm.h5", "mpm", frames=3, **SIZES)
    path, notes = imported(folder, *files, **more)
    path.rename(folder / "dem.h5")
    map_fields([folder / "mpm.h5", folder / "dem.h5"], folder / "fields.h5")
    return comparison.load(folder), notes


def found(metrics, name) -> list[dict]:
    return [one for one in metrics["findings"]["list"] if one["name"] == name]


def test_a_dump_can_be_compared(tmp_path):
    c, _ = compared(tmp_path, write(tmp_path / "a.dump"))
    metrics = conclusion.conclude(c, [])
    assert metrics["mass"]["mpm"] == pytest.approx(metrics["mass"]["dem"], rel=1e-12)
    assert metrics["run_out"]["dem"] == pytest.approx(0.9, abs=1e-9)
    assert metrics["cpu_seconds_engine"]["dem"] is None
    assert metrics["verdict"]["valid"] and not found(metrics, "no_release")
    (note,) = found(metrics, "imported")[1:]
    assert note["severity"] == "note" and "walls: 60 grains never move" in note["sentence"]


def test_what_disagrees_with_the_case_is_a_caution(tmp_path):
    def small(step, columns):
        return columns | {"radius": columns["radius"] / 2}

    c, _ = compared(tmp_path, write(tmp_path / "a.dump", small))
    assert [run.diameter for run in (*c.mpm, *c.dem)] == pytest.approx([D / 2] * 2)
    metrics = conclusion.conclude(c, [])
    (disagrees, _) = found(metrics, "imported")
    assert (
        disagrees["severity"] == "caution" and "diameter 0.001 m, the case" in disagrees["sentence"]
    )
    assert (
        "scatter of the packings is unknown (the grains' diameter" in metrics["verdict"]["scatter"]
    )
    for chart in all_charts():  # what is too thin to be seen is drawn all the same
        drawn = chart.draw(c, False)
        if drawn:
            drawn[0].draw_without_rendering()
            plt.close(drawn[0])


def test_lost_grains_spoil_the_result(tmp_path):
    def lose(step, columns):
        return {k: v[60 if step == 5000 else 0 :] for k, v in columns.items()}

    c, _ = compared(tmp_path, write(tmp_path / "a.dump", lose))
    metrics = conclusion.conclude(c, [])
    (lost,) = found(metrics, "matter_lost")
    assert lost["severity"] == "invalid" and lost["figure"] == pytest.approx(60 / 300)
    assert "stands as lost, not dissipated" in lost["advice"]


def test_grains_that_gain_energy_are_no_collapse(tmp_path):
    def rising(step, columns):
        moving = columns["type"] == 1
        return columns | {"y": columns["y"] + np.where(moving, 4e-6 * step, 0.0)}

    c, notes = compared(tmp_path, write(tmp_path / "a.dump", rising), up="y")
    metrics = conclusion.conclude(c, [])
    (gained,) = found(metrics, "no_release")
    assert gained["severity"] == "invalid" and not metrics["verdict"]["valid"]
    assert metrics["dissipated_energy"]["dem"] is None
    assert any(note.startswith("implausible: the grains gain") for note in notes)


def test_solid_that_is_too_dense_is_seen(tmp_path):
    def large(step, columns):
        return columns | {"radius": 1.4 * columns["radius"]}

    c, _ = compared(tmp_path, write(tmp_path / "a.dump", large, steps=[0, 2000]))
    findings.all_checks()
    (dense,) = findings.REGISTRY["too_dense"](c, {})
    assert dense.severity == "caution" and dense.figure is not None and dense.figure > 0.75
    (deep,) = findings.REGISTRY["overlaps"](c, {})
    # Radii of 1.4 mm, 1.43 mm apart where the block is flattest: (2.8 - 2/1.4)/2.8.
    assert deep.figure == pytest.approx((2.8 - 2 / 1.4) / 2.8, rel=1e-6)


def test_the_right_radii_are_not_too_dense(tmp_path):
    c, _ = compared(tmp_path, write(tmp_path / "a.dump", steps=[0]))
    findings.all_checks()
    assert not list(findings.REGISTRY["too_dense"](c, {}))
    assert not list(findings.REGISTRY["overlaps"](c, {}))


def test_one_frame_goes_all_the_way(tmp_path, capsys, monkeypatch):
    """To the report: no figure that needs time has a value, the others have theirs."""
    folder = tmp_path / "run"
    folder.mkdir()
    write_run(folder / "mpm.h5", "mpm", frames=3, **SIZES)
    monkeypatch.setattr(case, "load", lambda path: SCENE)
    file = write(tmp_path / "a.dump", steps=[0])
    words = ["compare", str(folder), "--case", "mine", "--dump", str(file), "--quiet"]
    code = cli.main([*words, "--wall-type", "3"])
    told = capsys.readouterr()
    assert code in (0, 4), told.err
    assert (
        "The grains have one frame" in " ".join(told.out.split())
        and (folder / "report.html").exists()
    )
    metrics = json.loads((folder / "metrics.json").read_text())
    for name in ("released_energy", "dissipated_energy", "kinetic_energy_peak", "run_out_t50"):
        assert metrics[name]["dem"] is None, name
    for name in ("kinetic_energy_peak_time", "stop_time", "run_out_t95"):
        assert metrics[name]["dem"] is None, name
    true = grains(0.0)["x"][:300]
    assert metrics["run_out"]["dem"] == pytest.approx(true.max() / SIZES["length"] - 1.0)
    assert metrics["centre_of_mass_x"]["dem"] == pytest.approx(true.mean() / SIZES["length"])
    # Imported grains may take the place of imported ones; those that were run only with --replace.
    assert open_run(folder / "dem.h5").imported
    write_run(folder / "dem.h5", "dem", frames=2, **SIZES)
    before = (folder / "dem.h5").read_bytes()
    assert cli.main(words) == 2 and "--replace" in capsys.readouterr().err
    assert (folder / "dem.h5").read_bytes() == before


def test_a_dump_needs_a_case(tmp_path, capsys):
    file = write(tmp_path / "a.dump")
    assert cli.main(["compare", str(tmp_path), "--dump", str(file), "--time-step", str(DT)]) == 2
    assert "--dump needs one RUN and --case" in capsys.readouterr().err
