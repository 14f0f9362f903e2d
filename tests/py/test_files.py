"""Files appear complete or not at all, and say where they come from."""

import matplotlib.figure
import pandas as pd
import pytest

from cases import files, provenance


def test_a_write_that_fails_leaves_what_was_there_and_nothing_else(tmp_path):
    target = tmp_path / "new" / "table.csv"
    files.write_atomically(target, "old")
    with pytest.raises(RuntimeError), files.replacing(target) as part:
        part.write_text("half")
        raise RuntimeError
    assert target.read_text() == "old" and list(target.parent.iterdir()) == [target]


def test_a_table_reads_back_below_its_head(tmp_path):
    rows = [
        {"name": "a, b", "value": 0.123456, "count": 3},
        {"name": "c", "value": 2.0, "count": 4},
    ]
    origin = provenance.about("the command")
    files.write_table(tmp_path / "t.csv", provenance.head(origin, "value [m]"), rows)
    lines = (tmp_path / "t.csv").read_text().splitlines()
    assert lines[0] == "# command: the command" and lines[1] == f"# commit: {provenance.commit()}"
    assert [line.split(":")[0] for line in lines[2:4]] == ["# date", "# machine"]
    assert lines[4] == "# value [m]"
    table = pd.read_csv(tmp_path / "t.csv", comment="#")
    assert table.to_dict("records") == [rows[0] | {"value": 0.1235}, rows[1]]


@pytest.mark.parametrize(
    "suffix, begins", [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")]
)
def test_a_figure_is_of_the_format_that_its_name_says(tmp_path, suffix, begins):
    target = tmp_path / f"figure.{suffix}"
    files.write_figure(target, matplotlib.figure.Figure())
    assert target.read_bytes().startswith(begins) and list(tmp_path.iterdir()) == [target]
