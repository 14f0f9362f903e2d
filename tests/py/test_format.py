"""The page of the least that a file must hold: its writer is run, and what it writes is taken."""

import re

import numpy as np
import pytest
import synthetic

from cases.errors import CaseError
from cases.programs import ROOT
from compare import __main__ as cli
from compare.mapping.clouds import open_grains
from compare.mapping.runs import map_fields, open_fields, open_run
from compare.report import report

PAGE = (ROOT / "compare" / "FORMAT.md").read_text()
DENSITY = synthetic.DENSITY


@pytest.fixture(scope="module")
def write():
    """The writer, as the page has it."""
    (code,) = re.findall(r"^```python\n(.*?)^```", PAGE, re.M | re.S)
    names: dict = {}
    exec(code, names)  # pylint: disable=exec-used
    return names["write"]


def frames(count=3, stretch=1.5):
    """A block of grains of two sizes that is stretched, frame by frame."""
    x0 = synthetic.block(0.04, 0.04, 0.008, 0.002)
    radius = np.where(np.arange(len(x0)) % 2, 0.0008, 0.001)
    mass = DENSITY * 4.0 / 3.0 * np.pi * radius**3
    motion = synthetic.Motion(x0, stretch, 5.0, np.sqrt(0.04 / 9.81))
    taus = np.linspace(0.0, 5.0, count)
    return [(tau * motion.scale, *motion.place(tau), mass, radius) for tau in taus]


def scene() -> str:
    sizes = {"height": 0.04, "length": 0.04, "thickness": 0.008}
    return synthetic.CASE.format(**sizes, void_ratio=0.7, floor_length=1.0)


def test_the_writer_is_short():
    (code,) = re.findall(r"^```python\n(.*?)^```", PAGE, re.M | re.S)
    assert len([line for line in code.splitlines() if line.strip()]) <= 26
    assert max(map(len, code.splitlines())) <= 100


def test_what_it_writes_is_opened(write, tmp_path):
    given = frames()
    write(tmp_path / "grains.h5", given)
    found = open_grains(tmp_path / "grains.h5")
    assert found.engine == "dem" and found.time == pytest.approx([frame[0] for frame in given])
    for cloud, (_, x, v, mass, radius) in zip(found.clouds, given):
        assert np.array_equal(cloud.x, x) and np.array_equal(cloud.v, v)
        assert np.array_equal(cloud.mass, mass)
        assert cloud.solid_volume == pytest.approx(4.0 / 3.0 * np.pi * radius**3)
    with pytest.raises(CaseError, match="needs a case"):
        open_run(tmp_path / "grains.h5")


def test_with_a_case_its_mass_is_mapped(write, tmp_path):
    given = frames()
    write(tmp_path / "dem.h5", given, case_resolved=scene())
    map_fields([tmp_path / "dem.h5"], tmp_path / "fields.h5")
    fields = open_fields(tmp_path / "fields.h5", "dem")
    mapped = fields["density"].sum(axis=(1, 2)) * fields.grid.cell_volume
    assert mapped == pytest.approx(np.full(3, given[0][3].sum()), rel=1e-12)


def test_it_is_exported(write, tmp_path):
    write(tmp_path / "grains.h5", frames())
    assert cli.main(["export", str(tmp_path / "grains.h5")]) == 0
    assert len(list((tmp_path / "vtk" / "grains").glob("*.vtu"))) == 3


def test_without_a_case_it_is_mapped(write, tmp_path):
    write(tmp_path / "grains.h5", frames())
    assert cli.main(["map", str(tmp_path / "grains.h5"), "--out", str(tmp_path / "map")]) == 0
    assert (tmp_path / "map" / "map.html").exists()


@pytest.mark.parametrize("both", [False, True])
def test_it_is_compared(write, tmp_path, monkeypatch, both):
    """With a run of ours, and with points of another program."""
    monkeypatch.setattr(report, "draw_all", lambda *_: [])
    write(tmp_path / "dem.h5", frames(), case_resolved=scene(), source="my code")
    if both:
        told = {"case_resolved": scene(), "source": "my code"}
        write(tmp_path / "mpm.h5", frames(stretch=1.8), engine="mpm", **told)
    else:
        synthetic.write_run(tmp_path / "mpm.h5", "mpm", frames=3, stretch=1.8)
    found = report.compare(tmp_path)["run_out_99"]
    assert found["dem"] == pytest.approx(0.5, abs=0.05)  # x0 stretched by 1.5, to half a grain
    assert found["mpm"] == pytest.approx(0.8, abs=0.05)
