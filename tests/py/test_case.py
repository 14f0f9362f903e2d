"""Cases as Python reads them."""

import pytest

from cases import case
from cases.errors import CaseError
from cases.programs import ROOT

COLUMN = ROOT / "cases" / "column"


def test_values_are_reached_by_dotted_key_and_by_table():
    scene = case.load(COLUMN)
    assert scene["geometry.height"] == scene["geometry"]["height"] == 0.1
    assert scene["mpm.points_per_cell"] == 2
    assert scene.path == COLUMN / "case.toml"
    assert scene.text == (COLUMN / "case.toml").read_text()


def test_overrides_hold():
    assert case.load(COLUMN, ["grains.friction=0.3"])["grains.friction"] == 0.3


def test_resolved_text_reads_back_to_the_same_values():
    scene = case.load(COLUMN)
    assert case.parse(scene.resolved).values == scene.values


def test_text_of_an_older_schema_has_the_defaults_of_newer_keys():
    scene = case.load(COLUMN)
    older = "\n".join(
        line for line in scene.resolved.splitlines() if not line.startswith("margin_distance")
    )
    assert older != scene.resolved
    assert case.parse(older).values == scene.values


def test_a_mistake_raises_the_validators_line():
    with pytest.raises(
        CaseError, match=r"^--set grains.friktion=1: unknown key .* Did you mean 'friction'\?$"
    ):
        case.load(COLUMN, ["grains.friktion=1"])
