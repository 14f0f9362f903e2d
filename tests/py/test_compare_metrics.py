"""Each metric against its own example, and against what the synthetic runs are known to hold."""

import numpy as np
import pytest

from compare.mapping import reductions
from compare.metrics import all_metrics


@pytest.mark.parametrize("name", sorted(all_metrics()))
def test_example_gives_the_known_answer(name):
    metric = all_metrics()[name]
    arguments, expected, tolerance = metric.example()
    assert metric(*arguments) == pytest.approx(expected, abs=max(tolerance, 1e-15))


@pytest.mark.parametrize("name", sorted(all_metrics()))
def test_every_metric_says_what_it_is(name):
    metric = all_metrics()[name]
    assert metric.unit and metric.source and metric.definition.endswith(".")
    assert (
        metric.function.__module__ == f"compare.metrics.{name}"
    ), "one file per metric, named after it"


def test_a_distance_of_equal_runs_is_zero():
    for name in (
        "wasserstein_x",
        "wasserstein_plane",
        "deposit_profile_l1",
        "deposit_profile_linf",
        "velocity_error",
        "dissipation_distance",
    ):
        (_, b), _, _ = all_metrics()[name].example()
        assert all_metrics()[name](b, b) == 0.0


def test_mass_quantile_of_a_whole_number_of_points_is_not_up_to_round_off():
    x = np.arange(1.0, 401.0)  # 398 of 400 equal masses are 99.5 %
    assert {
        reductions.mass_quantile(x, np.full(400, m), 0.995)
        for m in np.random.default_rng(0).random(50)
    } == {398.0}


def test_mass_quantile_counts_mass_not_points():
    assert (
        reductions.mass_quantile(np.array([3.0, 1.0, 2.0]), np.array([1.0, 8.0, 1.0]), 0.85) == 2.0
    )


def test_surface_ends_at_the_first_gap():
    run = reductions.example_run(solid_fraction=[[[0.5], [0.0], [0.5]]])
    assert reductions.surface(run, 0)[0] == pytest.approx(1.0)


def test_connected_mass_ignores_what_flies():
    run = reductions.example_run(solid_fraction=[[[0.5, 0.5, 0.0, 0.4]]])
    assert reductions.main_mass(run, 0).tolist() == [[True, True, False, False]]
