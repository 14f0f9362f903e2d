"""Spheres of YADE: its own files (tests/data/yade, made by spheres.py there), and broken ones."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cases.errors import CaseError
from compare.importing import registry
from mutations import mutated, read_or_refused

DATA = Path(__file__).parents[1] / "data/yade"
RADII = 0.004 + 0.0001 * np.arange(12)  # as spheres.py says
FILES = sorted(DATA.glob("*.txt"))


def frame_of(path: Path, **options):
    reader = registry.reader_of(path, ("grains", "contacts"))
    assert reader.name == "yade"
    (frame,) = reader.frames(path, options)
    return frame


@pytest.mark.parametrize("name", ["plain", "material", "numbered", "attributes"])
def test_formats(name):
    frame = frame_of(DATA / f"{name}_500.txt")
    assert frame.step == 500 and frame.time is None and frame.box is None
    columns = frame.columns
    np.testing.assert_allclose(columns["radius"], RADII, rtol=1e-12)
    # rows along x touch as they fall; across it nothing does
    np.testing.assert_allclose(columns["y"], 0.01 * (np.arange(12) // 3 % 2), rtol=0, atol=1e-9)
    np.testing.assert_array_equal(columns["id"], np.arange(1, 13))
    assert ("vz" in columns) == (name == "attributes")
    assert ("type" in columns) == (name in ("material", "numbered"))


def test_attributes_are_named_by_the_comment():
    columns = frame_of(DATA / "attributes_500.txt").columns
    # YADE rounds to six digits
    np.testing.assert_allclose(columns["mass"], 2500 * 4 / 3 * np.pi * RADII**3, rtol=1e-5)
    assert columns["vz"][0] == -0.15696 and not columns["vx"][0]


def test_no_ids_is_said(tmp_path):
    notes: list[str] = []
    frame_of(DATA / "plain_500.txt", notes=notes)
    assert len(notes) == 1 and "number of its row" in notes[0]


@pytest.mark.parametrize(
    "text, where",
    [
        ("#format x_y_z_r\n0 0 0 1\n0 0 0\n", ":3: 3 values instead of 4"),
        ("#format x_y_z_r\n0 0 0 1\n0 0 zero 1\n", ":3: 'zero' is no number"),
        ("#format x_y_z_r\n0 0 0 1\n\n# a\n0 0 1\n", ":5: 3 values instead of 4"),
        ("#format x_y_z_r\n0 0 0 1\n#format x_y_z_r\n0 0 1 1\n", ":3: another export begins"),
        ("#format x_y_z_r_attrs\n0 0 0 1 5\n", ":1: attributes without their names"),
        ("#format x_y_z_r_attrs\n# x y z r vx vy\n0 0 0 1 5\n", ":3: 5 values instead of 6"),
        ("#format x_y_z_r_wrong\n0 0 0 1\n", ":1: format 'x_y_z_r_wrong'"),
    ],
)
def test_refused_by_line(tmp_path, text, where):
    path = tmp_path / "spheres.txt"
    path.write_text(text)
    with pytest.raises(CaseError) as error:
        frame_of(path)
    assert f"{path}{where}" in str(error.value)


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(FILES), st.integers(0, 10**6))
def test_broken_files_are_read_or_refused(tmp_path_factory, file, seed):
    path = tmp_path_factory.mktemp("yade") / file.name
    path.write_bytes(mutated(file.read_bytes(), seed))
    read_or_refused(registry.readers()["yade"], path)
