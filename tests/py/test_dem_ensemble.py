"""Ensembles: tables that say where they come from, and an independent engine that agrees."""

import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from dem_reference import ensemble
from dem_reference.summary import SCALARS

REFERENCE = "cases/column_ci/reference"


def test_a_table_is_saved_with_its_origin(tmp_path):
    ensemble.save(
        pd.DataFrame({"seed": [1, 2], "run_out": [1.0, 2.0]}),
        tmp_path / "new" / "table.csv",
        "the command",
        "a note",
    )
    text = (tmp_path / "new" / "table.csv").read_text()
    assert text.startswith("# command: the command\n# commit: ")
    assert pd.read_csv(tmp_path / "new" / "table.csv", comment="#")["run_out"].tolist() == [
        1.0,
        2.0,
    ]
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["table.csv"]


def test_scatter_is_students_interval(tmp_path):
    values = np.array([1.0, 2.0, 4.0, 5.0])
    ensemble.save(
        pd.DataFrame({"seed": range(4), "run_out": values}), tmp_path / "table.csv", "", ""
    )
    words = ensemble.scatter(tmp_path / "table.csv").split()
    low, high = stats.t.interval(0.95, 3, values.mean(), stats.sem(values))
    assert float(words[1]) == pytest.approx(3.0)
    assert float(words[3]) == pytest.approx((high - low) / 2, rel=0.05)  # printed with two digits


def test_the_committed_ensemble_has_every_scalar_and_seed():
    table = pd.read_csv(f"{REFERENCE}/ensemble.csv", comment="#")
    assert list(table) == list(SCALARS)
    assert table["seed"].tolist() == list(range(1, 9))
    assert (table["unaccounted"].abs() < 0.05).all()


@pytest.mark.parametrize(
    "name",
    [
        "run_out",
        "kinetic_energy_peak",
        "kinetic_energy_peak_time",
        "released",
        "highest_grain_at_wall",
    ],
)
def test_lammps_agrees_within_the_scatter_of_seeds(name):
    """Two-sided Welch test at 1 % on eight seeds each.

    A difference of about 1.6 standard deviations would show.
    """
    table = pd.read_csv(f"{REFERENCE}/second_opinion.csv", comment="#")
    ours, theirs = (table.loc[table["engine"] == engine, name] for engine in ("liggghts", "lammps"))
    assert stats.ttest_ind(ours, theirs, equal_var=False).pvalue > 0.01


def test_the_cluster_profile_would_submit_one_job_per_seed(tmp_path):
    table = tmp_path / "table.csv"
    words = [
        "--seeds",
        "3",
        "--ranks",
        "2",
        "--profile",
        "cases/slurm",
        "--name",
        "dry",
        "--table",
        table,
        "--dry-run",
    ]
    done = subprocess.run(
        [sys.executable, "-m", "dem_reference.ensemble", "cases/column_ci", *words],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    said = done.stdout + done.stderr
    assert [f"{seed}.h5" in said for seed in (1, 2, 3, 4)] == [True, True, True, False]
    assert not table.exists()


def test_a_table_of_other_seeds_is_not_taken_for_the_one_asked(tmp_path):
    """A table that is there, such as the committed one, must not stand for runs that are not."""
    table = tmp_path / "table.csv"
    table.write_text("seed\n1\n")
    words = ["--seeds", "1", "--name", "stale", "--table", table, "--dry-run"]
    done = subprocess.run(
        [sys.executable, "-m", "dem_reference.ensemble", "cases/column_ci", *words],
        capture_output=True,
        text=True,
    )
    assert "1.h5" in done.stdout + done.stderr
