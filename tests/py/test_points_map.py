"""Material points of other codes mapped with what they tell: the rest is absent, not refused."""

import h5py
import numpy as np
import pytest

from cases.errors import CaseError
from compare.commands.map import arguments, run
from compare.importing.frame import Frame
from compare.importing.points_file import PointOptions, write_points
from compare.mapping.runs import map_fields
from cases.command_line import Parser

N, H, RHO, E, T, P = (6, 8, 6), 0.01, 2500.0, 0.7, 0.02, 300.0  # points, spacing, …
STRESS = {"stress_state", "pressure", "deviatoric_stress", "stress_ratio", "stress_power"}
SOLID = {"solid_fraction", "void_ratio", "void_ratio_state"}
OWN = STRESS | SOLID | {"granular_temperature_state", "inertial_number"}


def frame(step: int, *lacking: str) -> Frame:
    """A block of points of one volume, density, void ratio, temperature and stress."""
    axes = np.meshgrid(*(H * (np.arange(n) + 0.5) for n in N), indexing="ij")
    columns = {name: values.ravel() for name, values in zip("xyz", axes)}
    one = np.ones(columns["x"].size)
    columns |= {"vx": 1.0 + 2.0 * columns["y"], "vy": 0.0 * one, "vz": 0.0 * one}
    columns |= {"id": np.arange(one.size), "mass": RHO / (1.0 + E) * H**3 * one}
    columns |= {"volume": H**3 * one, "void_ratio": E * one, "temperature": T * one}
    columns |= {name: P * one for name in ("sxx", "syy", "szz")}
    columns |= {name: 0.0 * one for name in ("sxy", "syz", "szx")}
    left = {name: values for name, values in columns.items() if name[:2] not in lacking}
    left = {name: values for name, values in left.items() if name not in lacking}
    return Frame("here", left, step, 0.1 * step, compression=True)


def mapped(folder, *lacking: str, options=(), **told) -> dict[str, np.ndarray]:
    path = folder / "points.h5"
    words = PointOptions(up_told=True, **told)
    write_points([frame(step, *lacking) for step in (0, 1)], words, path)
    map_fields([path], folder / "fields.h5", *options)
    with h5py.File(folder / "fields.h5") as file:
        return {name: values[()] for name, values in file["points"].items() if name != "time"}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return mapped(tmp_path_factory.mktemp("whole"), diameter=H, density=RHO)


def inside(values: np.ndarray) -> np.ndarray:
    """Of the cell in the middle, in the last frame."""
    return values[-1][values.shape[1] // 2, values.shape[2] // 2]


def test_all_of_it(whole):
    """In the middle the block's own numbers stand, to what a lattice of points under a kernel of
    three quarters of its spacing ripples: 1 % and less.
    """
    assert OWN <= whole.keys()
    assert inside(whole["solid_fraction"]) == pytest.approx(1.0 / (1.0 + E), rel=0.01)
    assert inside(whole["granular_temperature_state"]) == pytest.approx(T, rel=1e-6)
    assert inside(whole["pressure"]) == pytest.approx(P, rel=0.01)


@pytest.mark.parametrize(
    "lacking, told, absent",
    [
        (("void_ratio",), {"diameter": H}, SOLID | {"inertial_number"}),
        (("void_ratio",), {"diameter": H, "density": RHO}, set()),
        (("temperature",), {"diameter": H, "density": RHO}, {"granular_temperature_state"}),
        (("sx", "sy", "sz"), {"diameter": H, "density": RHO}, STRESS | {"inertial_number"}),
        (("volume",), {"diameter": H, "density": RHO}, set()),
        (
            ("volume", "void_ratio"),
            {"diameter": H, "density": RHO},
            STRESS | {"void_ratio_state", "inertial_number"},
        ),
        (("volume", "void_ratio"), {"diameter": H}, STRESS | SOLID | {"inertial_number"}),
        (("volume", "void_ratio", "temperature", "sx", "sy", "sz"), {"diameter": H}, OWN),
    ],
)
@pytest.mark.parametrize("options", [(), ("--average",), ("--dimension", "1")])
def test_what_is_not_told_is_absent_and_the_rest_is_the_same(
    whole, tmp_path, lacking, told, absent, options
):
    found = mapped(tmp_path, *lacking, options=options, **told)
    assert OWN - found.keys() == absent
    if options:
        return
    for name, values in found.items():
        assert np.array_equal(values, whole[name], equal_nan=True) or np.allclose(
            values, whole[name], rtol=1e-6, equal_nan=True
        )


def test_lengths_without_a_diameter_are_the_points_own(tmp_path):
    """Of their volume, as spheres; else of their distance in the box around them."""
    for lacking, size in (
        ((), H * (6.0 / np.pi / (1.0 + E)) ** (1.0 / 3.0)),
        (("volume", "void_ratio"), H * np.prod([(n - 1.0) / n for n in N]) ** (1.0 / 3.0)),
    ):
        folder = tmp_path / str(len(lacking))
        folder.mkdir()
        assert "inertial_number" not in mapped(folder, *lacking)
        with h5py.File(folder / "fields.h5") as file:
            assert file.attrs["width"] == pytest.approx(0.75 * size, rel=1e-9)


def test_the_page_says_what_is_missing(tmp_path):
    path = tmp_path / "points.h5"
    write_points([frame(0, "void_ratio", "temperature")], PointOptions(up_told=True), path)
    parser = Parser()
    arguments(parser)
    assert run(parser.parse_args([str(path), "-o", str(tmp_path / "page")])) == 0
    page = next((tmp_path / "page").glob("*.html")).read_text()
    assert "points without a solid volume" in page and "points without one" in page


def test_one_place_tells_no_length(tmp_path):
    one = frame(0, "volume", "void_ratio")
    one.columns = {name: values[:1] for name, values in one.columns.items()}
    write_points([one], PointOptions(up_told=True), tmp_path / "points.h5")
    with pytest.raises(CaseError, match="one place tells no length"):
        map_fields([tmp_path / "points.h5"], tmp_path / "fields.h5")
