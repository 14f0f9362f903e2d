"""The launcher: set-up, commands, what `run` prints and leaves."""

import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import pytest

from cases.errors import CaseError
from cases.programs import ROOT, name_of
from compare import version
from compare.commands import test as test_command
from cases.lookup import find_case
from compare.commands.run import verdict
from compare.targets import COMMANDS, targets

LAUNCHER = ROOT / "grainpair"
LAWS = sorted(file.stem for file in (ROOT / "mpm" / "materials").glob("*.cpp"))


def launch(*words, **options) -> subprocess.CompletedProcess:
    return subprocess.run(
        [LAUNCHER, *words], capture_output=True, text=True, timeout=600, **options
    )  # it may have to build


def test_help_lists_every_command():
    listed = launch("--help").stdout
    for file in (ROOT / "compare" / "commands").glob("[a-z]*.py"):
        assert re.search(rf"\n  {file.stem.replace('_', '-')}\s", listed)


def test_unknown_command_is_bad_input():
    result = launch("rum")
    assert result.returncode == 2 and "Did you mean 'run'?" in result.stderr


def test_it_works_from_any_folder_and_through_a_link(tmp_path):
    link = tmp_path / "grainpair"
    link.symlink_to(LAUNCHER)
    result = subprocess.run(
        [link, "describe", "walls.gate_speed"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        timeout=120,
    )
    assert result.stdout.startswith("walls.gate_speed") and result.returncode == 0


def test_set_up_costs_little_when_nothing_is_to_be_done():
    launch("describe", "title")

    def processor_time():
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return used.ru_utime + used.ru_stime

    before = processor_time()
    launch("describe", "title")
    assert (
        processor_time() - before < 0.6
    )  # [s] 0.2 on an idle machine, more where the cores are shared


def test_missing_packages_are_named_with_the_command_that_installs_them():
    # Outside pytest's folders, which only their owner can enter: nobody must be able to run the
    # copy.
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)
        copy = Path(shutil.copy(LAUNCHER, folder))
        for part in ("cases", "compare"):
            shutil.copytree(ROOT / part, Path(folder) / part, copy_function=shutil.copyfile)
        (Path(folder) / "packages.txt").write_text(
            "# needed\nbash\nno-such-package  # for a reason\nnor-such\n"
        )
        user: dict[str, Any] = {"user": "nobody"} if os.getuid() == 0 else {}
        user["env"] = os.environ | {"GRAINPAIR_BUILD": f"{folder}/build"}
        result = subprocess.run([copy, "run"], capture_output=True, text=True, timeout=60, **user)
    assert result.returncode == 3
    assert result.stderr == (
        "grainpair: packages are missing. Install them with: "
        "sudo apt-get install --no-install-recommends no-such-package nor-such\n"
    )


def test_cases_are_found_by_name_folder_and_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").touch()
    assert find_case("column_ci").resolve() == ROOT / "cases" / "column_ci"
    assert find_case("mine.toml") == Path("mine.toml")
    assert find_case("./nowhere") == Path("./nowhere")
    assert name_of(Path("mine.toml")) == "mine"
    assert name_of(ROOT / "cases" / "column" / "case.toml") == "column"


@pytest.mark.parametrize(
    "word, guess", [("colum_ci", "column_ci"), ("shaer", "shear"), ("zzz", None), ("n" * 300, None)]
)
def test_a_mistyped_case_is_guessed_and_all_are_named(word, guess):
    with pytest.raises(CaseError, match=f"^{word}: no such case .known: .*column_small.*") as said:
        find_case(word)
    assert str(said.value).endswith(f"Did you mean '{guess}'?" if guess else ").")


def test_verdict_is_a_line_a_headline_with_both_engines_and_their_difference():
    names = [
        "run_out_95",
        "centre_of_mass_x",
        "final_height",
        "kinetic_energy_peak_time",
        "dissipated_energy",
        "moving_without_stress",
        "cpu_seconds_engine",
    ]
    metrics = {
        name: {"mpm": 1.1, "dem": 1.0, "relative_difference": 0.1, "unit": "L0"} for name in names
    }
    metrics["run_out_95"] |= {"verdict": "agree", "stored_std": 0.02}
    metrics["run_out_95"]["numerical_uncertainty"] = 0.03
    metrics["dissipated_energy"] |= {"verdict": "not decidable", "because": "11 % lost"}
    metrics["final_height"]["mpm"] = metrics["final_height"][
        "relative_difference"
    ] = None  # a result without a number
    header, *lines = verdict(metrics).splitlines()
    assert header.split() == ["MPM", "DEM", "MPM/DEM", "-", "1"]
    assert len(lines) == 7
    assert lines[0].split("[L0]")[1].split() == "1.1 ± 0.03 1 ± 0.02 +10.0 % agree".split()
    assert lines[2].split()[-3:] == ["-", "1", "-"]
    assert lines[4].endswith("   not decidable: 11 % lost")


@pytest.mark.parametrize(
    "word, start", [("geometry.height", "geometry.height "), ("column_ci", "title = ")]
)
def test_describe_knows_keys_and_cases(word, start):
    assert launch("describe", word).stdout.startswith(start)


def test_doctor_sets_nothing_up_and_says_what_is_there():
    result = launch("doctor")
    assert "engine liggghts" in result.stdout and "package cmake" in result.stdout
    assert result.returncode == (3 if "MISSING" in result.stdout else 0)


@pytest.fixture
def empty_clone(tmp_path):
    """The launcher and all it reads, in a folder where nothing is built; and a build folder whose
    making would be seen, with tools that would build or install replaced by ones that cry.
    """
    clone = tmp_path / "clone"
    for folder in ("cases", "compare", "dem_reference", "mpm"):
        (clone / folder).parent.mkdir(exist_ok=True)
        (clone / folder).symlink_to(ROOT / folder)
    for file in ("grainpair", "CMakeLists.txt"):
        shutil.copy(ROOT / file, clone / file)
    (clone / "packages.txt").write_text("no-such-package\n")
    tools = tmp_path / "tools"
    tools.mkdir()
    for name in ("cmake", "ninja", "apt-get"):
        (tools / name).write_text(f"#!/bin/sh\necho {name} was called >&2\nexit 9\n")
        (tools / name).chmod(0o755)
    environment = os.environ | {"PATH": f"{tools}:{os.environ['PATH']}"}
    environment["GRAINPAIR_BUILD"] = str(clone / "build" / "release")  # not where ours was built

    def call(*words):
        return subprocess.run(
            [clone / "grainpair", *words],
            capture_output=True,
            text=True,
            timeout=60,
            env=environment,
            check=False,
        )

    yield call
    assert not (clone / "build").exists()


@pytest.mark.parametrize(
    "words, code, said",
    [
        (["--help"], 0, "usage: grainpair"),
        (["-h"], 0, "usage: grainpair"),
        (["--version"], 0, "grainpair 0"),
        ([], 2, "usage: grainpair"),
        (["run", "--help"], 0, "--seeds"),
        (["bench", "-h"], 0, "--quick"),
    ],
)
def test_asking_builds_and_installs_nothing(empty_clone, words, code, said):
    result = empty_clone(*words)
    assert (result.returncode, result.stderr) == (code, "")
    assert said in result.stdout


def test_a_word_that_is_no_command_builds_nothing(empty_clone):
    result = empty_clone("rum")
    assert result.returncode == 2 and "no such command" in result.stderr
    assert "was called" not in result.stderr


def test_version_names_all_that_a_result_depends_on(empty_clone):
    lines = empty_clone("--version").stdout.splitlines()
    assert re.fullmatch(r"grainpair \d+\.\d+\.\d+, commit \S+", lines[0])
    rows = dict(line.strip().split(maxsplit=1) for line in lines[1:])
    assert set(rows) == {"programs", "compiler", *version.LIBRARIES}
    assert rows["programs"] == "not built"


def test_help_lacks_only_the_options_where_a_package_is_missing():
    hide = (
        "import sys; sys.modules['tqdm'] = None; from compare.__main__ import main; "
        "main(['run', '--help'])"
    )
    shown = subprocess.run(
        [sys.executable, "-c", hide], capture_output=True, text=True, check=True, cwd=ROOT
    ).stdout
    assert "Run a case with both engines" in shown and "once tqdm is installed" in shown


def test_the_version_is_the_same_wherever_it_stands():
    cited = re.search(r"^version: (\S+)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    logged = re.search(r"^## \[(\d\S*)\]", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert cited and logged
    assert cited[1] == logged[1] == version.number()


def test_every_command_names_targets_that_the_build_has():
    made = "\n".join(file.read_text() for file in ROOT.rglob("CMakeLists.txt"))
    for command in (file.stem for file in COMMANDS.glob("[a-z]*.py")):
        for target in set(targets([command])) - {"all"}:
            assert re.search(rf"(add_executable|add_custom_target)\({target}\b", made), command
    assert targets(["bench"]) == ["benchmarks"]
    assert targets(["run"]) == ["programs"]
    assert targets(["run", "cases/laws/drucker_prager"]) == ["programs", "laws"]
    assert targets(["test"]) == ["all"] == targets(["test", "--only", "solver"])
    assert not targets(["bench", "--help"]) and not targets(["rum"]) and not targets([])


def test_the_benchmarks_are_built_by_their_own_target_only():
    made = (ROOT / "CMakeLists.txt").read_text()
    depends = re.search(r"add_custom_target\(benchmarks DEPENDS ([^)]*)\)", made)
    assert depends
    called = re.findall(r'timed\(\s*"([\w/]+)"', (COMMANDS / "bench.py").read_text())
    assert {Path(name).name for name in called} == set(depends[1].split())


@pytest.mark.parametrize("law", LAWS)
def test_only_a_law_is_the_battery_and_the_tests_that_name_it(law):
    chosen = test_command.tests_of(law)
    assert f"*/{law}" in chosen["material_test"]
    assert list(chosen) == targets(["test", "--only", law]) == targets(["test", f"--only={law}"])
    own = ROOT / "tests" / "cpp" / f"{law}_test.cpp"
    assert (chosen.get(own.stem) == "*") == own.exists()
    assert "coarse_grain_test" not in chosen


def test_a_build_folder_of_another_clone_is_used_as_it_is(empty_clone, tmp_path, monkeypatch):
    build = tmp_path / "other"
    build.mkdir()
    (build / "CMakeCache.txt").write_text("CMAKE_HOME_DIRECTORY:INTERNAL=/elsewhere\n")
    result = subprocess.run(
        [LAUNCHER, "describe", "walls.gate_speed"],
        capture_output=True,
        text=True,
        timeout=60,
        env=os.environ | {"GRAINPAIR_BUILD": str(build)},
        check=False,
    )
    assert result.returncode != 0 and not list(build.glob("*.ninja"))
    assert not (build / "lock").exists()
