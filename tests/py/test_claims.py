"""The table of stated figures: complete, and able to notice a figure that no longer holds."""

import pytest

from compare.commands import claims
from cases.errors import CaseError

GOOD = """
[[claim]]
id = "half"
statement = "a half"
target = "0.5"
value = 0.5
unit = "-"
relation = "{relation}"
tolerance = 0.01
reason = "two digits"
command = "true"
quick = true
measure = "{measure}"
"""


def half():
    return 0.505


def less():
    return 0.4


@pytest.fixture
def table(tmp_path, monkeypatch):
    monkeypatch.setattr(claims, "CLAIMS", tmp_path)

    def write(text, **words):
        (tmp_path / "table.toml").write_text(text.format(**words))

    return write


class Quick:
    quick = True


@pytest.mark.parametrize(
    "relation, function, code",
    [
        ("equal", "half", 0),
        ("equal", "less", 1),
        ("at_most", "less", 0),
        ("at_most", "half", 1),
        ("at_least", "half", 0),
        ("at_least", "less", 1),
    ],
)
def test_a_figure_that_no_longer_holds_is_noticed(table, relation, function, code):
    table(GOOD, relation=relation, measure=f"{__name__}.{function}")
    assert claims.run(Quick) == code


@pytest.mark.parametrize(
    "key", ["statement", "target", "value", "unit", "tolerance", "reason", "command", "measure"]
)
def test_an_incomplete_claim_is_refused(table, key):
    lines = [line for line in GOOD.splitlines() if not line.startswith(key)]
    table("\n".join(lines), relation="equal", measure="x.y")
    with pytest.raises(CaseError, match=f"claim 'half' has no '{key}'"):
        claims.read()


def test_two_claims_of_one_name_are_refused(table):
    table(GOOD + GOOD, relation="equal", measure="x.y")
    with pytest.raises(CaseError, match="two claims are called 'half'"):
        claims.read()


def test_the_projects_own_table_is_complete():
    claims.read()
