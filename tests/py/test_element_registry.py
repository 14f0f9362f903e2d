"""An element test is one file: the campaign and the command need to know no more of it."""

import tomllib
from types import SimpleNamespace
from typing import Any

import pytest

from cases.errors import CaseError
from cases.programs import ROOT
from compare.element import campaign, tests
from dem_reference.grains import Grains

DUMMY = """\
from compare.element.tests import ElementTest, register

register(
    ElementTest(
        "dummy",
        order=9,
        keys=("weight",),
        points=lambda case: [({"weight": 2.0}, 1), ({"weight": 0.5}, 1)],
        run=lambda grains, point, folder: [{"answer": point["weight"] * grains.diameter}],
    )
)
"""


class DummyCase(SimpleNamespace):
    test, path = "dummy", "dummy/case.toml"
    grains = Grains(2e-3, 2532.0, 3e8, 0.3, 0.879, 0.5)

    def __getitem__(self, key):
        return {"element.grains": 50, "element.time_step_fraction": 0.19}[key]


@pytest.fixture
def dummy(tmp_path, monkeypatch):
    """A case of a test that is nothing but a file beside the others."""
    tests.all_tests()  # those that are there register with the registry that stays
    (tmp_path / "dummy.py").write_text(DUMMY)
    monkeypatch.setattr(tests, "__path__", [*tests.__path__, str(tmp_path)])
    monkeypatch.setattr(tests, "REGISTRY", dict(tests.REGISTRY))
    return DummyCase(folder=tmp_path)


def test_a_new_file_is_found_and_its_points_run(dummy):
    assert [test.name for test in tests.all_tests()][-1] == "dummy"
    assert "dummy" not in [test.name for test in tests.compared_tests()]
    found = campaign.points(dummy)
    assert [campaign.name_of(dummy, point) for point in found] == ["2_1", "0.5_1"]
    assert campaign.missing(dummy) == found
    (row,) = campaign.run_point(dummy, found[1])
    assert (row["status"], row["answer"], row["grains"]) == ("measured", 1e-3, 50)


def test_a_case_of_no_test_is_refused_in_one_line():
    case: Any = DummyCase()
    with pytest.raises(CaseError, match="'dummy' .* use one of shear, cooling"):
        tests.test_of(case)


def test_every_test_of_the_schema_has_its_file():
    schema = tomllib.loads((ROOT / "cases" / "element_schema.toml").read_text())
    assert {test.name for test in tests.all_tests()} == set(schema["element"]["test"]["choices"])
