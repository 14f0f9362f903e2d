"""The stored scatter of packings: taken where it is of the same grains, refused in a line where it
is not; and the evidence for the headlines.
"""

import re

import numpy as np
import pandas as pd
import pytest

from cases.case import load, parse
from cases.errors import CaseError
from cases.programs import ROOT
from compare.commands import run as run_command
from compare.mapping.runs import map_fields, open_run
from compare.metrics import all_metrics
from compare.report import report
from compare.study import headlines
from compare.study.packings import columns, of_signatures, write
from compare.verdict import comparison, conclusion, packings
from dem_reference.content import inputs
from synthetic import write_pair

CI = ROOT / "cases" / "column_ci"
TABLES = sorted((ROOT / "cases").glob(f"*/{packings.TABLE}"))


def store(folder, case, values):
    """A table of packings of `case` in the folder of a case."""
    rows = [{"seed": i} | {name: v[i] for name, v in values.items()} for i in range(4)]
    write(rows, inputs(case), folder / packings.TABLE, "test")


@pytest.fixture
def pair(tmp_path):
    """A synthetic pair, and an empty folder of cases."""
    folder = write_pair(tmp_path / "runs", mpm={"frames": 3}, dem={"frames": 3})
    map_fields(sorted(folder.glob("*.h5")), folder / "fields.h5")
    return folder, open_run(folder / "dem.h5"), tmp_path / "cases"


def judged(folder, stored) -> dict:
    c = comparison.load(folder)
    c.packings = stored
    return conclusion.conclude(c, [])


def test_a_single_pair_takes_the_scatter_of_its_packings_and_says_so(pair):
    folder, dem, cases = pair
    store(cases / "mine", dem.case, {"run_out_95": [1.0, 1.01, 0.99, 1.0]})
    stored = packings.of_run(dem, cases)
    assert stored.words.startswith("scatter of the 4 packings of ")
    assert stored.words.endswith("mine/reference/ensemble_metrics.csv")
    metrics = judged(folder, stored)
    assert metrics["run_out_95"]["verdict"] == "agree"
    deviation = np.std([1.0, 1.01, 0.99, 1.0], ddof=1)
    assert metrics["run_out_95"]["stored_std"] == pytest.approx(deviation, rel=1e-3)
    assert metrics["run_out_95"]["half_width"] == pytest.approx(2.3534 * deviation, rel=1e-3)
    # what the table lacks has no scatter, as before
    assert metrics["final_height"]["verdict"] == "within margin"
    assert metrics["final_height"]["half_width"] is None
    assert metrics["verdict"]["value"] == "within margin"
    told = " ".join(line.strip() for line in conclusion.lines(metrics))
    assert told.startswith(f"verdict: within margin; {stored.words}")


@pytest.mark.parametrize(
    "line, key",
    [("diameter = 0.002", "grains.diameter"), ("floor_length = 1.0", "geometry.floor_length")],
)
def test_packings_of_other_grains_are_not_taken_and_the_input_is_named(pair, line, key):
    folder, dem, cases = pair
    other = parse(dem.case.resolved.replace(line, line + "5"))
    store(cases / "mine", other, {"run_out_95": [1.0, 1.01, 0.99, 1.0]})
    stored = packings.of_run(dem, cases)
    assert stored.scatter == {}
    assert "scatter of the packings is unknown" in stored.words and f"has {key} = " in stored.words
    assert judged(folder, stored)["run_out_95"]["verdict"] == "within margin"


def test_the_nearest_of_several_tables_is_named(pair):
    _, dem, cases = pair
    far = parse(dem.case.resolved.replace("0.002", "0.003").replace("2500.0", "2600.0"))
    near = parse(dem.case.resolved.replace("2500.0", "2600.0"))
    for name, case in (("a", far), ("b", near), ("c", far)):
        store(cases / name, case, {"run_out_95": [1.0, 1.01, 0.99, 1.0]})
    words = packings.of_run(dem, cases).words
    assert "b/reference" in words and "grains.density = 2600.0, not 2500.0" in words


def test_a_table_of_a_users_own_case_is_found_by_the_runs_command(pair):
    _, dem, cases = pair
    own = cases.parent / "own"
    store(own, dem.case, {"run_out_95": [1.0, 1.01, 0.99, 1.0]})
    assert packings.of_run(dem, cases).scatter == {}
    dem.attributes["command"] = f"python3 -m dem_reference.run {own / 'case.toml'} -o dem.h5"
    assert packings.of_run(dem, cases).scatter["run_out_95"].packings == 4


def test_a_table_that_does_not_say_what_it_was_made_of_is_not_taken(pair):
    _, dem, cases = pair
    path = cases / "mine" / packings.TABLE
    path.parent.mkdir(parents=True)
    path.write_text("# command: by hand\nseed,run_out_95\n1,1.0\n2,1.1\n")
    assert packings.of_run(dem, cases).words.endswith("(no table of packings is stored)")


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.parts[-3])
def test_a_committed_table_is_of_the_packings_of_its_case(path):
    made_of, case = packings.completed(packings.stated(path)), load(path.parents[1])
    assert packings.differences(made_of, inputs(case)) == []
    assert set(packings.read(path).scatter) <= {one.name for one in columns()}


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.parts[-3])
def test_strays_scatter_the_outermost_run_out_as_the_docs_say(path):
    scatter = packings.read(path).scatter
    share = scatter["run_out"].deviation / scatter["run_out_95"].deviation
    assert 2.5 < share < 9.5  # "three to nine times"


def test_signatures_give_the_rows_that_are_committed():
    path = ROOT / "cases" / "column" / packings.TABLE
    kept = pd.read_csv(path, comment="#")
    scene = load(path.parents[1])
    again = pd.DataFrame(of_signatures(path.with_name("grains.json"), scene))
    pd.testing.assert_frame_equal(kept, again, rtol=1e-4, check_dtype=False)


def test_signatures_of_other_grains_are_refused():
    with pytest.raises(CaseError, match="grains.friction"):
        of_signatures(CI / "reference" / "grains.json", load(CI, ["grains.friction=0.05"]))


def test_headlines_and_terminal_name_metrics_that_there_are():
    assert {*report.HEADLINES, *run_command.VERDICT} <= set(all_metrics())
    assert set(run_command.VERDICT) <= set(report.HEADLINES)
    # run_out counts strays: it is told, and decides nothing
    assert "run_out" not in {*report.HEADLINES, *run_command.VERDICT}
    assert not all_metrics()["run_out"].decides


def test_the_headlines_tell_laws_better_than_packings():
    table = pd.read_csv(CI / "reference" / "headlines.csv", comment="#").set_index("metric")
    chosen = [name for name in table.index if name in run_command.VERDICT]
    assert chosen == ["run_out_95", "centre_of_mass_x", "final_height"]
    assert (table.loc[chosen, "change_over_scatter"] > 1.0).all()
    reach = ["run_out", "run_out_99", "run_out_height", "run_out_connected"]
    assert (
        table.loc[chosen[:2], "change_over_scatter"].min()
        > table.loc[reach[0:], "change_over_scatter"]
    ).all()


def test_the_table_in_the_docs_is_the_one_that_is_kept():
    table = pd.read_csv(CI / "reference" / "headlines.csv", comment="#")
    text = (ROOT / "compare" / "README.md").read_text()
    for _, row in table.iterrows():
        cells = [f"`{row['metric']}`", *(f"{row[k]:.3g}" for k in ("mean", "scatter", "change"))]
        cells.append(f"{row['change_over_scatter']:.2g}")
        assert re.search(r"\| *" + r" *\| *".join(map(re.escape, cells)) + r" *\|", text), cells


def test_one_final_height_for_both_engines(tmp_path):
    """The same points, called continuum and called grains, have the same height and free surface.

    The grid of the map is the same for both, so is the bulk's solid fraction: the case's.
    """
    same = {"frames": 2, "jitter": False, "spacing": 0.001, "seed": 1}
    folder = write_pair(tmp_path, mpm=same, dem=same)
    map_fields(sorted(folder.glob("*.h5")), folder / "fields.h5")
    metrics = comparison.evaluate(comparison.load(folder))
    for name in ("final_height", "run_out_height", "centre_of_mass_x", "run_out_95"):
        assert metrics[name]["difference"] == pytest.approx(0.0, abs=1e-9)


def test_friction_moves_the_headline_as_stated():
    """A small member of cases/column_ci/reference/headlines.csv, measured again."""
    table = pd.read_csv(CI / "reference" / "headlines.csv", comment="#").set_index("metric")
    found = headlines.change(load(CI), 0.1, ("centre_of_mass_x",))
    assert found["centre_of_mass_x"] == pytest.approx(
        table.loc["centre_of_mass_x", "change"], rel=0.1
    )
