"""Verdicts that agree, differ and abstain where they should; error rates checked by simulation."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from compare.verdict import equivalence as verdict
from compare.verdict.controls import WORDS


def test_close_ensembles_agree():
    assert verdict.equivalence([1.00], [1.01, 0.99, 1.0, 1.005, 0.995], 0.05).word == verdict.AGREE


def test_far_ensembles_differ():
    assert verdict.equivalence([1.5], [1.01, 0.99, 1.0, 1.005, 0.995], 0.05).word == verdict.DIFFER


def test_scatter_wider_than_the_margin_leaves_it_unresolved():
    assert verdict.equivalence([1.0], [0.7, 1.3, 1.1, 0.9, 1.0], 0.05).word == verdict.UNRESOLVED


def test_a_single_pair_gives_no_verdict_of_equivalence():
    assert verdict.equivalence([1.0], [1.01], 0.05).word == verdict.WITHIN
    assert verdict.equivalence([1.0], [1.10], 0.05).word == verdict.OUTSIDE


def test_what_is_undefined_is_unresolved():
    assert verdict.equivalence([float("nan")], [1.0, 1.1], 0.05).word == verdict.UNRESOLVED


def test_half_width_is_the_one_sample_t_interval_for_a_deterministic_continuum():
    dem = np.array([1.0, 1.2, 0.9, 1.1, 1.05])
    # t_{0.95, 4} = 2.1318 (tables)
    expected = 2.13185 * dem.std(ddof=1) / np.sqrt(5)
    assert verdict.confidence_half_width(np.array([1.0]), dem) == pytest.approx(expected, rel=1e-5)


def test_false_agreement_is_as_rare_as_claimed():
    # At a true difference equal to the margin, "agree" is the error TOST bounds by 5 %; 4000 trials
    # scatter by 0.35 %.
    random = np.random.default_rng(1)
    words = [
        verdict.equivalence([1.0], random.normal(1.05, 0.02, 8), 0.05).word for _ in range(4000)
    ]
    assert words.count(verdict.AGREE) / 4000 <= 0.05 + 3 * 0.0035
    assert words.count(verdict.AGREE) / 4000 >= 0.03  # and the test is not trivially strict


def test_one_packing_of_known_scatter_is_tested_as_one():
    # t_{0.95, 7} = 1.8946 (tables); one packing stands for the mean with the whole deviation.
    known = verdict.Scatter(0.01, 8)
    found = verdict.equivalence([1.0], [1.01], 0.05, known)
    assert found.half_width == pytest.approx(0.018946, rel=1e-4)
    assert found.word == verdict.AGREE
    assert verdict.equivalence([1.0], [1.04], 0.05, known).word == verdict.UNRESOLVED
    assert verdict.equivalence([1.0], [1.08], 0.05, known).word == verdict.DIFFER
    # several packings of this run's own are their own scatter
    two = verdict.equivalence([1.0], [1.01, 1.02], 0.05, known)
    assert two.half_width == verdict.equivalence([1.0], [1.01, 1.02], 0.05).half_width


def test_false_agreement_of_one_packing_is_as_rare_as_claimed():
    # The mean of packings is a margin away; one packing is seen, the deviation comes from 8 others.
    random, words = np.random.default_rng(2), []
    for _ in range(4000):
        stored = verdict.Scatter(random.normal(0.0, 0.01, 8).std(ddof=1), 8)
        words.append(verdict.equivalence([1.0], [random.normal(1.05, 0.01)], 0.05, stored).word)
    assert 0.03 <= words.count(verdict.AGREE) / 4000 <= 0.05 + 3 * 0.0035


@pytest.mark.parametrize(
    "dem, numerical, word",
    [
        ([1.03], 0.0, "within margin"),
        ([1.03], 0.03, "unresolved"),
        ([1.07], 0.0, "outside margin"),
        ([1.07], 0.03, "unresolved"),
        ([1.10], 0.03, "outside margin"),
        ([1.02, 1.021, 1.019], 0.01, "agree"),
        ([1.02, 1.021, 1.019], 0.04, "unresolved"),
    ],
)
def test_what_the_numerics_may_be_off_by_widens_the_interval(dem, numerical, word):
    assert verdict.equivalence([1.0], dem, 0.05, numerical=numerical).word == word
    # a distance too: from zero, by as much
    distances = [abs(1.0 - x) for x in dem]
    assert verdict.distance(distances, 0.05, numerical).word == word


@pytest.mark.parametrize(
    "difference, loss, word",
    [
        (0.03, 0.04, "within margin"),
        (0.03, 0.108, "not decidable"),
        (0.08, 0.108, "not decidable"),  # the loss alone may make it
        (0.30, 0.108, "outside margin"),
        (0.03, -0.108, "not decidable"),  # energy made is no better than energy lost
    ],
)
def test_an_energy_is_not_decidable_where_the_loss_exceeds_the_margin(difference, loss, word):
    assert verdict.equivalence([1.0 + difference], [1.0], 0.05).decided_by(loss).word == word


# Steps of 1e-6: a scatter below the rounding of the shift would vanish with it.
@settings(
    deadline=None, suppress_health_check=[HealthCheck.too_slow]
)  # a loaded machine is slow to draw them
@given(
    st.lists(st.integers(-(10**7), 10**7).map(lambda k: 1e-6 * k), min_size=2, max_size=6),
    st.floats(0.01, 1.0),
    st.floats(-5, 5),
)
def test_verdict_depends_on_differences_only(values, margin, shift):
    a = verdict.equivalence([values[0]], values, margin)
    b = verdict.equivalence([values[0] + shift], [v + shift for v in values], margin)
    # Shifted numbers are rounded; a verdict may tip only when it stood on the edge.
    edge = min(
        abs(abs(a.difference) + a.half_width - margin),
        abs(abs(a.difference) - a.half_width - margin),
    )
    assert a.word == b.word or edge < 1e-9


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["agree", "agree"], "agree"),
        (["agree", "unresolved"], "unresolved"),
        (["differ", "unresolved"], "differ"),
        (["within margin"], "within margin"),
        (["within margin", "outside margin"], "outside margin"),
        (["agree", "within margin"], "within margin"),
        (["agree", "not decidable"], "not decidable"),
        (["differ", "not decidable"], "differ"),
        ([], "unresolved"),
    ],
)
def test_overall(words, expected):
    assert verdict.overall(words) == expected


@pytest.mark.parametrize(
    "path", sorted(Path("cases").glob("*/reference/verdicts.csv")), ids=lambda path: path.parts[1]
)
def test_every_committed_table_of_verdicts_rejected_its_controls(path):
    overall = path.read_text().splitlines()[2]
    assert [f"control_{name} rejected" in overall for name in WORDS] == [True, True, True]
    table = pd.read_csv(path, comment="#")
    for name in WORDS:
        assert (table[name] == "differ").any()
    # the verdict follows from the numbers beside it
    for _, row in table[table["verdict"] != verdict.UNDECIDABLE].iterrows():
        width = row["half_width"] + np.nan_to_num(row.get("numerical_uncertainty", 0.0))
        low, high = abs(row["difference"]) - width, abs(row["difference"]) + width
        assert row["verdict"] == (
            "agree" if high <= row["margin"] else "differ" if low > row["margin"] else "unresolved"
        )
