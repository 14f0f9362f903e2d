"""The element tests' case files and records."""
import shutil

import pytest

from cases.errors import CaseError
from cases.programs import ROOT
from compare.element import campaign, records
from compare.element.case import Case


@pytest.mark.parametrize(
    "test",
    [
        "shear",
        "shear/slow.toml",
        "shear/loose.toml",
        "reversal",
        "bumpy_shear",
        "cooling",
        "triaxial",
        "triaxial/rolling",
        "triaxial/sizes",
        "isotropic",
        *(f"{test}/rolling" for test in ("shear", "reversal", "cooling", "isotropic")),
    ],
)
def test_every_shipped_case_is_valid_and_names_its_points_apart(test):
    case = Case(ROOT / "cases" / test)
    names = [campaign.name_of(case, point) for point in campaign.points(case)]
    assert len(set(names)) == len(names) > 0


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (
            ("restitution = 0.879", "restitution = 1.5"),
            "case.toml:12: grains.restitution = 1.5 is out of bounds (outside 0.06 .. 1)",
        ),
        (
            ("friction = 0.5", "friktion = 0.5"),
            "rolling_model, rolling_damping). Did you mean 'friction'?",
        ),
        (("friction = 0.5", ""), "case.toml: missing key 'grains.friction'"),
        (("strain = 10.0", "strain = 'ten'"), "case.toml:18: shear.strain must be a number"),
        (
            ("rates = [", "rates = 20.0 # ["),
            "case.toml:17: shear.rates must be a list of at least one value",
        ),
        (
            ('test = "shear"', 'test = "sheer"'),
            "case.toml:4: unknown element.test 'sheer' (known: shear, bumpy_shear",
        ),
        (('test = "shear"', 'test = "cooling"'), "case.toml:16: unknown key 'shear."),
        (
            ("friction = 0.5", "friction = 0.5\nsize_spread = 0.1"),
            'grains.size_spread = 0.1 contradicts element.test = "shear" (only triaxial and',
        ),
    ],
)
def test_a_wrong_case_is_refused_in_one_line(tmp_path, change, complaint):
    text = (ROOT / "cases" / "shear" / "case.toml").read_text()
    assert change[0] in text
    (tmp_path / "case.toml").write_text(text.replace(*change))
    with pytest.raises(CaseError) as error:
        Case(tmp_path)
    assert complaint in str(error.value) and "\n" not in str(error.value)


def test_records_survive_writing_and_a_campaign_goes_on_where_it_stopped(tmp_path):
    shutil.copy(ROOT / "cases" / "cooling" / "case.toml", tmp_path)
    case = Case(tmp_path)
    everything = campaign.missing(case)
    assert everything == campaign.points(case)
    rows = [
        point | {"time": 0.125, "status": "failed: why", "commit": "12e4567", "machine": "a, b"}
        for point in everything[:3]
    ]
    records.write(records.reference_file(case), rows, "command")
    assert records.read(records.reference_file(case)) == rows
    assert campaign.missing(case) == everything[3:]  # a failure is data: it is not tried again
    header = records.reference_file(case).read_text().splitlines()[:4]
    assert [line.split(":")[0] for line in header] == [
        "# command",
        "# commit",
        "# machine",
        "# seeds",
    ]
