"""What an import takes: the measure works, and what the README states is the table's."""

import re

import pandas as pd

from cases.programs import ROOT
from compare.importing import timing

TABLE = ROOT / "cases/chute/reference/import_cost.csv"


def test_both_kinds_of_files_are_imported(tmp_path):
    for make, rows in ((timing.text_dump, 2 * 10**3), (timing.mercury, 2 * 2 * 3 * 6**2 * 5)):
        row = timing.measured(make, 1000, 2)
        assert row["rows"] == rows and 0.0 < row["wall_s"] < 60.0 and 0.0 < row["memory_GB"] < 1.0


def test_the_readme_states_the_table():
    table = pd.read_csv(TABLE, comment="#").set_index("files")
    assert (table["rows"] > 9.8e6).all() and (table["frames"] == 10).all()
    text = " ".join((ROOT / "compare/README.md").read_text().split())
    for words, name in (
        (r"A million grains in ten frames of text take (\d+) s and ([\d.]+) GB", "text_dump"),
        (r"ten million rows of MercuryDPM's contacts (\d+) s and ([\d.]+) GB", "mercury"),
    ):
        found = re.search(words, text)
        assert found, words
        seconds, memory = map(float, found.groups())
        row = table.loc[name]
        assert abs(seconds - row["wall_s"]) < 0.5 and abs(memory - row["memory_GB"]) < 0.005
