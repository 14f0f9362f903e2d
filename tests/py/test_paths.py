"""A clone, its results and its build may lie anywhere, whatever its folders are called."""

from importlib.util import find_spec

import clones
import pytest

from cases.programs import module
from compare import targets

ODD = "a b#c'$&(é%"


@pytest.fixture(scope="module")
def odd(tmp_path_factory):
    return clones.copied(tmp_path_factory.mktemp("odd") / ODD)


@pytest.mark.parametrize("colon", [False, True])
@pytest.mark.parametrize("more", [["walls.gate=lifted", "walls.gate_speed=1.0"], []], ids=str)
def test_the_grains_run_in_a_clone_of_an_odd_name(odd, tmp_path, more, colon):
    """Of the packing, the gate's triangles, and MPI's ranks the engine gets only plain names."""
    out = tmp_path / ("o:ut" if colon else 'o ut#"$x') / "dem.h5"
    sets = [word for one in [*more, "time.maximum=0.25"] for word in ("--set", one)]
    words = module("dem_reference.run", "cases/column_ci", "-o", out, *sets)
    words[4] = str(odd / "cases" / "start.py")
    words += ["--ranks", "2"] if not more and find_spec("mpi4py") else []
    build = clones.built(tmp_path / "build #1")
    done = clones.call(words, odd, GRAINPAIR_BUILD=str(build), HOME=str(tmp_path))
    assert (done.returncode, done.stderr) == (0, "")
    assert out.is_file() and len(list(out.parent.iterdir())) == 1
    assert list((odd / "runs" / "packings").iterdir())


def test_the_launcher_works_in_a_clone_of_an_odd_name(odd, tmp_path):
    build = clones.built(tmp_path / "b d")
    around = {"GRAINPAIR_BUILD": str(build), "HOME": str(tmp_path)}
    shown = clones.call([odd / "grainpair", "describe", "column_ci"], tmp_path, **around)
    assert (shown.returncode, shown.stderr) == (0, "")
    seeds = ["--seeds", "2", "--quiet", "--set", "geometry.thickness=0.003"]
    refused = clones.call([odd / "grainpair", "run", "column_ci", *seeds], tmp_path, **around)
    assert "less than 2 grain diameters" in refused.stderr, refused.stderr  # a job of an ensemble


@pytest.mark.parametrize(
    "name, plain", [("a b", True), ("é+1", True), ("a#b", False), ("<", False)]
)
def test_cmake_is_told_a_path_that_it_takes(tmp_path, monkeypatch, name, plain):
    clone = tmp_path / name
    clone.mkdir()
    monkeypatch.setattr(targets, "ROOT", clone)
    monkeypatch.delenv("GRAINPAIR_BUILD", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    _, source, build, *_ = map(targets.Path, targets.plan(["describe"]))
    assert source.resolve() == clone
    assert (source == clone) == plain == build.is_relative_to(clone)
    assert targets.plain(source) and targets.plain(build)
