"""Cases as Python reads them."""

import tomllib

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


def test_other_kinds_are_read_by_the_same_validator():
    assert case.load(ROOT / "cases" / "shear", kind="element")["element.grains"] == 500
    ladder = case.load(ROOT / "cases" / "ladder.toml", kind="study")
    assert ladder["ladder.rung"][0] == {
        "name": "Drucker–Prager, 4 cells",
        "engine": "mpm",
        "cells": 4,
        "set": {"material.law": "drucker_prager"},
    }
    by_name = case.load(ROOT / "cases" / "column_ci" / "study.toml", kind="")
    assert by_name.values == case.load(by_name.path, kind="study").values


@pytest.mark.parametrize("file", sorted((ROOT / "cases").glob("*/study.toml")), ids=str)
def test_a_checked_study_is_what_its_author_wrote_and_the_defaults(file):
    holds(case.load(file, kind="study").values, tomllib.loads(file.read_text()))


def holds(checked, written):
    """Everything written is there, of the same type and in the same order."""
    assert type(checked) is type(written)
    if isinstance(written, dict):
        assert not written.keys() - checked.keys()
        for key, value in written.items():
            holds(checked[key], value)
            if key in ("set", "vary", "where"):
                assert list(checked[key]) == list(value)
    elif isinstance(written, list):
        assert len(checked) == len(written)
        for one, other in zip(checked, written):
            holds(one, other)
    else:
        assert checked == written


def test_a_kind_nobody_knows_and_overrides_where_none_belong_are_refused():
    with pytest.raises(CaseError, match="^--kind scenery: unknown .known: scene, element"):
        case.load(COLUMN, kind="scenery")
    with pytest.raises(CaseError, match="only a scene takes --set"):
        case.load(ROOT / "cases" / "shear", ["grains.friction=0.3"], kind="element")


def test_a_restitution_of_walls_that_no_engine_takes_is_refused():
    assert case.load(COLUMN, ["walls.restitution=0.5"])["walls.restitution"] == 0.5
    with pytest.raises(CaseError, match="walls.restitution = 0.03 is out of bounds"):
        case.load(COLUMN, ["walls.restitution=0.03"])
