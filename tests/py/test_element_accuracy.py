"""`grainpair accuracy`: the errors it prints fall with the step, and its figure is written."""
import re
from argparse import Namespace

import pytest

from compare.commands import accuracy
from cases.programs import ROOT, program

pytestmark = pytest.mark.skipif(not program("mpm_point").exists(), reason="mpm_point is not built")


def test_errors_fall_with_the_step(tmp_path, monkeypatch, capsys):
    """Backward Euler is of first order in the dissipation.

    So 16 times the steps leave less than a quarter of the error.
    """
    monkeypatch.setattr(accuracy, "STEPS", (10, 160))
    monkeypatch.setattr(accuracy, "REFERENCE", 640)
    assert (
        accuracy.run(Namespace(case=ROOT / "cases" / "column", out=tmp_path / "accuracy.svg")) == 0
    )
    rows = re.findall(
        r"^(implicit|dormand_prince)\s+(\d+)\s+(\S+)\s+(\S+)\s+(\S+)\s+(\d+)\s+(\d+)$",
        capsys.readouterr().out,
        re.M,
    )
    error = {
        (name, int(steps)): (float(stress), float(dissipation))
        for name, steps, _, stress, dissipation, _, _ in rows
    }
    assert len(error) == 4
    assert error["implicit", 160][1] < error["implicit", 10][1] / 4
    assert error["implicit", 160][0] < error["implicit", 10][0]
    # Error control does better than any step here.
    assert error["dormand_prince", 160][1] < error["implicit", 160][1] / 10
    assert (tmp_path / "accuracy.svg").read_text().lstrip().startswith("<?xml")
