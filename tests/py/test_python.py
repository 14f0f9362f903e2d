"""`import grainpair`: what it gives is what the files hold and what the project computes."""

import json
import subprocess
import sys

import h5py
import numpy as np
import pytest

import clones
import synthetic
from cases.programs import PYTHON, ROOT, module
from compare.mapping.runs import map_fields, open_run
from compare.verdict import comparison, conclusion

PACKAGE = ROOT / "compare" / "python"
sys.path.insert(0, str(PACKAGE))
import grainpair  # noqa: E402
from grainpair import starting  # noqa: E402

TUTORIAL = PACKAGE / "tutorial.ipynb"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A compared pair of made-up runs."""
    folder = synthetic.write_pair(tmp_path_factory.mktemp("python") / "pair")
    map_fields([folder / "mpm.h5", folder / "dem.h5"], folder / "fields.h5")
    metrics = conclusion.conclude(comparison.load(folder), [])
    (folder / "metrics.json").write_text(json.dumps(metrics))
    return folder


@pytest.fixture
def pair(folder):
    return grainpair.Pair(folder)


def test_a_folder_is_a_pair_and_a_file_is_a_result(folder, pair):
    assert isinstance(grainpair.open(folder), grainpair.Pair)
    assert (pair.mpm.engine, pair.dem.engine) == ("mpm", "dem")
    alone = grainpair.open(str(folder / "dem.h5"))
    assert isinstance(alone, grainpair.Result)
    assert len(alone.frames) == len(alone.time) == len(pair.dem.frames)
    assert alone.case["geometry.height"] == open_run(folder / "dem.h5").case["geometry.height"]
    assert alone.attributes["seed"] == 2


def test_records_are_what_the_file_holds(folder, pair):
    for side in (pair.mpm, pair.dem):
        frame = side.frames[-1]
        with h5py.File(side.path) as file:
            steps = sorted(file["data"], key=int)
            cloud = file[f"data/{steps[-1]}/particles/cloud"]
            assert frame.time == file[f"data/{steps[-1]}"].attrs["time"]
            assert set(frame.records) == set(cloud)
            assert np.array_equal(frame["mass"], cloud["mass"][()])
            for column, axis in enumerate("xyz"):
                assert np.array_equal(frame["velocity"][:, column], cloud[f"velocity/{axis}"][()])
            assert frame["positionOffset"].shape == frame["position"].shape
            assert frame.unit("velocity") == "m/s" and frame.unit("mass") == "kg"
        run = open_run(side.path)
        assert np.array_equal(frame["position"][frame.moving], run.clouds[-1].x)
    assert [frame.step for frame in pair.dem.frames[:3]] == [int(step) for step in steps[:3]]
    assert pair.dem.frames[0].contacts is None  # which the made-up runs have not


def test_a_tensor_is_symmetric_and_in_its_places(tmp_path):
    path = tmp_path / "mpm.h5"
    synthetic.write_run(path, "mpm", frames=2)
    names = ("xx", "yy", "zz", "xy", "yz", "zx")
    with h5py.File(path, "a") as file:
        step = max(file["data"], key=int)
        cloud = file[f"data/{step}/particles/cloud"]
        cloud.pop("stress", None)
        rows = len(cloud["mass"])
        for number, name in enumerate(names):
            cloud[f"stress/{name}"] = np.full(rows, number, float)
    stress = grainpair.Result(path).frames[-1]["stress"]
    assert stress.shape == (rows, 3, 3)
    assert np.array_equal(stress[0], [[0.0, 3.0, 5.0], [3.0, 1.0, 4.0], [5.0, 4.0, 2.0]])


def test_contacts_come_as_the_file_has_them(tmp_path):
    path = tmp_path / "dem.h5"
    synthetic.write_run(path, "dem", frames=2)
    with h5py.File(path, "a") as file:
        contacts = file.create_group("data/0/contacts")
        contacts["first"], contacts["second"] = [1, 2], [2, -3]
        for number, name in enumerate(("branch", "position", "force")):
            for axis in "xyz":
                contacts[f"{name}/{axis}"] = [float(number), ord(axis)]
    found = grainpair.Result(path).frames[0].contacts
    assert (
        found and len(found) == 2 and found.second.tolist() == [2, -3] and found.dissipation is None
    )
    assert found.force.tolist() == [[2.0, 2.0, 2.0], [120.0, 121.0, 122.0]]


def test_histories_are_tables_with_units(pair):
    energy = open_run(pair.mpm.path).energy
    table = pair.mpm.history
    assert set(table) == set(energy) - {"time"} and np.array_equal(table.index, energy["time"])
    assert np.array_equal(table["kinetic"], energy["kinetic"])
    assert table.attrs["units"]["kinetic"] == "J" and table.attrs["units"]["time"] == "s"


def test_verdicts_are_those_of_the_folder_and_come_out_again(folder, pair):
    told = json.loads((folder / "metrics.json").read_text())
    assert pair.metrics == told and pair.verdict == conclusion.headline(told)
    assert pair.verdicts.loc["run_out_95", "verdict"] == told["run_out_95"]["verdict"]
    before = sorted(file.stat().st_mtime_ns for file in folder.iterdir())
    assert json.loads(json.dumps(pair.recomputed()["run_out_95"])) == told["run_out_95"]
    assert sorted(file.stat().st_mtime_ns for file in folder.iterdir()) == before


def test_what_is_recomputed_is_of_the_files_and_not_of_the_page(folder, tmp_path):
    other = synthetic.write_pair(tmp_path / "other", mpm={"stretch": 2.5, "jitter": False})
    map_fields([other / "mpm.h5", other / "dem.h5"], other / "fields.h5")
    (other / "metrics.json").write_text((folder / "metrics.json").read_text())
    pair = grainpair.Pair(other)
    assert pair.recomputed()["run_out_95"]["mpm"] > 1.1 * pair.metrics["run_out_95"]["mpm"]


def test_fields_are_those_that_were_mapped(folder, pair):
    fields = pair.arrays("mpm")
    with h5py.File(folder / "fields.h5") as file:
        assert np.array_equal(fields["density"], file["mpm/density"][()])
    with pytest.raises(
        grainpair.CaseError, match="no fields of dem_2 .there are those of dem, mpm"
    ):
        pair.arrays("dem_2")


def test_fields_are_a_dataset_of_xarray(folder, pair):
    pytest.importorskip("xarray")
    fields = pair.fields("mpm")
    plain = pair.arrays("mpm")
    assert fields["density"].dims == ("time", "y", "x")
    assert fields["velocity"].dims == ("time", "y", "x", "component")
    assert fields["density"].attrs["units"] == "kg/m3"
    assert np.array_equal(fields["x"], plain.grid.x) and np.array_equal(fields["time"], plain.time)
    row = fields["velocity"].isel(time=-1, y=2).sel(component="y")
    assert np.array_equal(row, plain["velocity"][-1, 2, :, 1], equal_nan=True)


def test_without_xarray_a_line_says_what_to_install(pair, monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(grainpair.EngineError, match="install the package python3-xarray"):
        pair.fields()


@pytest.mark.parametrize(
    "what, line",
    [
        (lambda pair: grainpair.open(pair.folder / "nowhere"), "cannot be read"),
        (lambda pair: grainpair.open(pair.folder / "metrics.json"), "not HDF5"),
        (lambda pair: grainpair.open(pair.folder.parent), "no mpm.h5"),
        (lambda pair: pair.dem.frames[0]["colour"], "no record colour .there are "),
        (lambda pair: pair.dem.frames[0].unit("colour"), "no record colour"),
    ],
)
def test_what_is_wrong_is_one_line(pair, what, line):
    with pytest.raises(grainpair.CaseError, match=line) as error:
        what(pair)
    assert "\n" not in str(error.value)


def test_a_folder_that_was_not_compared_says_how(tmp_path):
    pair = grainpair.Pair(synthetic.write_pair(tmp_path / "pair"))
    for ask in (lambda: pair.metrics, lambda: pair.arrays(), pair.recomputed):
        with pytest.raises(grainpair.CaseError, match=r"make it with: \./grainpair compare"):
            ask()


def test_values_of_keys_are_toml():
    assert starting.toml(0.25) == "0.25" and starting.toml(True) == "true"
    assert starting.toml('a "b"') == r'"a \"b\""' and starting.toml([1, "x"]) == '[1, "x"]'


@pytest.mark.parametrize(
    "asked, line",
    [
        ({"case": "colum_ci"}, "Did you mean 'column_ci'?"),
        ({"case": "column_ci", "sets": {"grains.frction": 1}}, "Did you mean 'friction'?"),
        ({"case": "column_ci", "seeds": 0}, "no whole number"),
    ],
)
def test_a_run_that_is_refused_is_a_case_error(tmp_path, monkeypatch, asked, line):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(grainpair.CaseError) as error:
        grainpair.run(**asked, out=tmp_path / "out")
    assert line in str(error.value) and "\n" not in str(error.value)
    assert not (tmp_path / "out").exists()


def test_the_tutorial_runs(tmp_path, monkeypatch, capsys):
    """Its cells one after the other, as a notebook's; their figures are those of the report."""
    monkeypatch.chdir(tmp_path)
    cells = json.loads(TUTORIAL.read_text())["cells"]
    assert not any(cell.get("outputs") for cell in cells)  # nothing that ages is kept
    names: dict = {}
    for number, cell in enumerate(cells):
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), f"cell {number}", "exec"), names)
    pair, metrics = names["pair"], json.loads((tmp_path / "runs/tutorial/metrics.json").read_text())
    assert (tmp_path / "runs/tutorial/report.html").exists()
    # text of JSON gives doubles back to the last bit
    assert names["run_out"] == pytest.approx(metrics["run_out_95"]["dem"], rel=1e-12)
    assert names["again"]["run_out_95"] == metrics["run_out_95"]
    assert 0.5 < names["share"] < 1.01  # of a collapse that has come to rest, to the audit's 1 %
    # fields are doubles, exact to round-off of sums over some thousand cells
    assert names["mapped"] / names["mass"].sum() == pytest.approx(1.0, rel=1e-9)
    assert "Did you mean 'column_ci'?" in capsys.readouterr().out
    assert pair.metrics == metrics


def test_the_command_starts_pythons_own_words():
    def python(*words, **more):
        command = module("compare", "python", *words)
        return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, **more)

    asked = "import grainpair, sys; print(grainpair.__name__, *sys.argv[1:])"
    assert python("-c", asked, "-h", "--version").stdout == "grainpair -h --version\n"
    assert python("-", input="print(6 * 7)").stdout == "42\n"
    assert python("-c", "import sys; sys.exit(7)").returncode == 7
    assert python("--version").stdout.startswith("Python 3")
    assert "import grainpair" in python("--help").stdout


def test_a_module_of_the_users_own_name_is_said(tmp_path):
    (tmp_path / "cases.py").touch()
    command = [PYTHON, "-c", f"import sys; sys.path.append({str(PACKAGE)!r}); import grainpair"]
    done = clones.call(command, tmp_path)
    assert done.returncode == 1
    assert "a module of yours is called cases" in done.stderr.splitlines()[-1]


def test_a_package_that_imports_it_is_not_taken_for_a_module_of_ours(tmp_path):
    """Where Python looks for the module of -m, its package is imported, and so are we."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "__init__.py").write_text("import grainpair\n")
    (tmp_path / "mine" / "tool.py").write_text("print('mine')\n")
    done = clones.call([PYTHON, "-m", "mine.tool"], tmp_path, PYTHONPATH=str(PACKAGE))
    assert (done.returncode, done.stdout) == (0, "mine\n"), done.stderr
