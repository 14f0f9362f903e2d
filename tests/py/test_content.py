"""What is kept is found again by what decides it: inputs and sources, no name, no commit."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import pandas as pd
import pytest

from cases import content
from cases.case import load
from cases.programs import ROOT
from cases.reading import attributes
from compare.study import keys
from compare.study.recipe import Recipe
from dem_reference import content as grains

CI = ROOT / "cases" / "column_ci"
PROGRAMS = [f"compare.study.{name}" for name in ("point", "boundary", "figures")]


@pytest.fixture
def clone(tmp_path) -> Path:
    """A copy of all that is written by hand, without the studies' references."""
    root = tmp_path / "clone"
    for folder in ("cases", "mpm", "dem_reference", "compare"):
        ignored = shutil.ignore_patterns("reference", "__pycache__")
        shutil.copytree(ROOT / folder, root / folder, ignore=ignored)
    for file in ("CMakeLists.txt", "CMakePresets.json", "README.md"):
        shutil.copy(ROOT / file, root / file)
    return root


def names(root: Path) -> dict[str, list[str]]:
    """The keys of every kind of result, by engine, as the sources below `root` make them."""
    scene = load(CI)
    out = {
        engine: [keys.key(program, Recipe(engine), scene, root=root) for program in PROGRAMS]
        for engine in ("mpm", "dem")
    }
    out["dem"] += [grains.packing_key(scene, 1, root), grains.ensemble_key(scene, root=root)]
    return out


def add_a_line(file: Path):
    assert file.exists()
    file.write_text(file.read_text() + "\n")


@pytest.mark.parametrize(
    "file", ["README.md", "mpm/EQUATIONS.md", "dem_reference/README.md", "cases/materials/new.md"]
)
def test_text_changes_no_key(clone, file):
    before = names(clone)
    (clone / file).touch()
    add_a_line(clone / file)
    assert names(clone) == before


@pytest.mark.parametrize(
    "file, engine",
    [
        ("mpm/materials/lade_duncan.cpp", "mpm"),
        ("mpm/materials/quasi_static.hpp", "mpm"),
        ("mpm/CMakeLists.txt", "mpm"),
        ("cases/schema.toml", "mpm"),
        ("dem_reference/contacts.py", "dem"),
        ("dem_reference/process.py", "dem"),
        ("dem_reference/ledger/moment.cpp", "dem"),
        ("dem_reference/scripts/bodies.in", "dem"),
    ],
)
def test_a_source_of_an_engine_changes_every_key_of_that_engine_and_no_other(clone, file, engine):
    before = names(clone)
    add_a_line(clone / file)
    after = names(clone)
    other = {"mpm": "dem", "dem": "mpm"}[engine]
    assert after[other] == before[other]
    assert not set(after[engine]) & set(before[engine])


def test_what_a_point_is_measured_with_decides_points_but_no_grains(clone):
    before = names(clone)
    add_a_line(clone / "compare" / "study" / "signature.py")
    after = names(clone)
    changed = {old for engine in before for old in before[engine]} - {
        new for engine in after for new in after[engine]
    }
    assert {name.split("-")[0] for name in changed} == {"point", "boundary"}


def test_benchmarks_and_recipes_are_no_sources_of_the_continuum(clone):
    before = names(clone)
    for file in ("mpm/bench/law_benchmark_main.cpp", "cases/ladder.toml"):
        add_a_line(clone / file)
    assert names(clone) == before


def test_an_import_inside_a_function_counts_and_so_do_the_packages_around_it(tmp_path):
    files = {
        "a/__init__.py": "",
        "a/entry.py": "def f():\n    from .b import g\n",
        "a/b/__init__.py": "from a import other\n",
        "a/b/g.py": "import os, a.last as last\n",
        "a/other.py": "",
        "a/last.py": "",
        "a/stranger.py": "import a.entry\n",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    found = {str(file.relative_to(tmp_path)) for file in content.imported("a.entry", root=tmp_path)}
    assert found == files.keys() - {"a/stranger.py"}


def test_every_module_that_a_grain_run_loads_is_among_its_sources():
    """What Python itself says it has loaded of this clone once a run of the grains stands ready."""
    line = (
        "import sys, dem_reference.run; modules = list(sys.modules.values()); "
        "print(*(m.__file__ for m in modules if getattr(m, '__file__', None)), sep='\\n')"
    )
    told = subprocess.run(
        [sys.executable, "-c", line], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    loaded = {Path(name) for name in told.splitlines() if Path(name).is_relative_to(ROOT)}
    assert loaded and loaded <= content.imported("dem_reference.run")


def test_a_program_older_than_its_sources_fills_its_own_place(tmp_path, monkeypatch):
    monkeypatch.setenv("GRAINPAIR_BUILD", str(tmp_path))
    assert content.of_continuum() == content.of_files(content.continuum())
    (tmp_path / "mpm_run.sources").write_text("what it was built from\n")
    assert content.of_continuum() == "what it was built from"


@pytest.mark.parametrize(
    "told, packing, runs",
    [
        ("grains.friction=0.05", True, True),
        ("initial.void_ratio=0.72", True, True),
        ("walls.gate_speed=0.5", False, True),
        ("time.maximum=7", False, True),
        ("dem.audit_interval=7", False, True),
        ("output.contacts=false", False, True),
        ('title="another"', False, False),
        ("material.stress_ratio=1.1", False, False),
        ("mpm.cell_size=0.004", False, False),
        ("compare.margin_run_out=0.2", False, False),
    ],
)
def test_only_what_decides_grains_counts(told, packing, runs):
    sets = [told, 'walls.gate="lifted"'] if "gate" in told else [told]
    plain, changed = load(CI), load(CI, sets)
    assert (grains.packing_key(plain, 1) != grains.packing_key(changed, 1)) == packing
    assert (grains.ensemble_key(plain) != grains.ensemble_key(changed)) == runs


def test_a_material_card_counts_by_what_stands_in_it(tmp_path, monkeypatch):
    case = tmp_path / "cases" / "scene" / "case.toml"
    shutil.copytree(ROOT / "cases" / "materials", tmp_path / "cases" / "materials")
    shutil.copytree(ROOT / "cases" / "column", tmp_path / "cases" / "column")
    case.parent.mkdir()
    case.write_text('extends = "../column/case.toml"\n')
    monkeypatch.chdir(case.parent)  # a card that --set names is looked for from there
    recipe = Recipe("mpm", ("material.card=dem_mu05",))
    before = keys.key("compare.study.point", recipe, load(case))
    assert before == keys.key("compare.study.point", recipe, load(case))
    card = tmp_path / "cases" / "materials" / "dem_mu05.toml"
    card.write_text(card.read_text().replace("stress_ratio = ", "stress_ratio = 0.9  # "))
    assert before != keys.key("compare.study.point", recipe, load(case))


# A handful of grains that hardly move: seconds.
TINY = (
    "geometry.height=0.012",
    "geometry.length=0.01",
    "geometry.floor_length=0.05",
    "geometry.thickness=0.004",
    "time.maximum=0.2",
    "dem.packing_attempts=1",
)


def ensemble(table: Path, *words) -> subprocess.CompletedProcess:
    sets = [word for told in TINY for word in ("--set", told)]
    command = [sys.executable, "-m", "dem_reference.ensemble", CI, *sets, "--table", table, *words]
    return subprocess.run([str(w) for w in command], cwd=ROOT, capture_output=True, text=True)


def test_a_name_never_stands_for_content(tmp_path, monkeypatch):
    """Of another friction, grains run anew under the same name; asked the old question again, the
    old runs answer.
    """
    monkeypatch.setenv("GRAINPAIR_RUNS", str(tmp_path / "runs"))
    asked = {
        "first": ["--seeds", 1],
        "other": ["--seeds", 1, "--set", "grains.friction=0.05"],
        "again": ["--seeds", 2],
    }
    rows = {}
    for question, words in asked.items():
        done = ensemble(tmp_path / f"{question}.csv", "--name", "X", *words)
        assert done.returncode == 0, done.stderr
        rows[question] = pd.read_csv(tmp_path / f"{question}.csv", comment="#")
    assert rows["other"]["kinetic_energy_peak"][0] > 1.5 * rows["first"]["kinetic_energy_peak"][0]
    assert rows["again"].iloc[0].equals(rows["first"].iloc[0])  # the processor seconds too
    assert len(rows["again"]) == 2
    frictions = set()
    for file in (tmp_path / "runs" / "ensembles").rglob("1.h5"):
        with h5py.File(file) as run:
            frictions.add("friction = 0.05" in attributes(run)["case_resolved"])
    assert frictions == {True, False}
    head = (tmp_path / "other.csv").read_text().split("\n")
    (made_of,) = (line for line in head if line.startswith("# made of: "))
    assert json.loads(made_of.removeprefix("# made of: "))["grains.friction"] == 0.05
