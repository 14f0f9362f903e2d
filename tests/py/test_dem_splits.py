"""Splits of the dissipation over time, from files whose numbers are known.

Deviations of softer and coarser grains.
"""

import h5py
import numpy as np
import pandas as pd
import pytest

from cases.errors import CaseError
from dem_reference.approximations import MEASURES, deviations
from dem_reference.splits import shares, table


def write(path, normal, enduring=(0.6, 0.4, 0.3, 0.2), interval=0.9):
    """A run that releases 2 J evenly over 1 s = 2 sqrt(H/g).

    `normal` J by normal damping, the rest of 2 J tangentially.
    """
    time = np.linspace(0, 1, 11)
    with h5py.File(path, "w") as file:
        file.attrs.update(time_scale=0.5, case_resolved="[dem]\nlifetime_threshold = 2.0\n")
        for name, end in (
            ("time", 1),
            ("dissipated_normal", normal),
            ("dissipated_tangential", 2 - normal),
            ("dissipated", 2),
        ):
            file[f"energy/{name}"] = end * time
        file["energy/potential"] = 5 - 2 * time
        file["lifetime/dissipated_enduring"] = np.outer(time, enduring)
        file["lifetime/multiples"] = [0.5, 1, 2, 4]
        file["lifetime"].attrs.update(interval=interval, unit_time=1.0)
    return path


def test_shares_are_of_the_energy_released(tmp_path):
    found = shares(write(tmp_path / "a.h5", 0.5))
    assert found["time"].iloc[-1] == pytest.approx(2.0)
    last, middle = found.iloc[-1], found.iloc[10]
    assert [last[name] for name in ("normal", "tangential", "total")] == pytest.approx(
        [0.25, 0.75, 1.0]
    )
    assert [last[f"short_{k}"] for k in (1, 2, 4, 8)] == pytest.approx(
        [0.7, 0.8, 0.85, 0.9]
    )  # (2 - enduring) / 2
    assert middle["normal"] == pytest.approx(0.125)


def test_a_threshold_below_the_sampling_interval_is_left_out(tmp_path):
    found = shares(write(tmp_path / "a.h5", 0.5, interval=1.5))
    assert "short_1" not in found and "short_2" in found


def test_the_scatter_is_that_of_the_runs(tmp_path):
    found = table([write(tmp_path / "a.h5", 0.4), write(tmp_path / "b.h5", 0.8)]).iloc[-1]
    assert found["normal"] == pytest.approx(0.3) and found["normal_deviation"] == pytest.approx(
        0.2 / np.sqrt(2)
    )
    assert found["total_deviation"] == pytest.approx(0.0, abs=1e-15)


def test_a_run_without_the_split_is_refused(tmp_path):
    with h5py.File(write(tmp_path / "a.h5", 0.5), "a") as file:
        del file["lifetime"]
    with pytest.raises(CaseError, match="no split"):
        shares(tmp_path / "a.h5")


def test_deviations_are_of_means_and_of_lengths():
    """Final length 2 -> 2.2 is + 10 %; one seed borrows the scatter of the next table."""
    fine = pd.DataFrame({name: [1.0] for name in (*MEASURES, "cpu_seconds")})
    coarse = pd.DataFrame({name: [1.1, 1.3] for name in (*MEASURES, "cpu_seconds")})
    rows = deviations({"d": fine, "2 d": coarse})
    assert rows["run_out_99"].tolist() == pytest.approx([0.0, 10.0])
    assert rows["highest_grain_at_wall"].tolist() == pytest.approx([0.0, 20.0])
    scatter = 0.2 / np.sqrt(2)
    assert rows["highest_grain_at_wall_error"].tolist() == pytest.approx(
        [100 * scatter, 100 * scatter * np.sqrt(1.5)]
    )
