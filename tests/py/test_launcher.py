"""The launcher: set-up, commands, what `run` prints and leaves."""

import os
import re
import resource
import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest

from compare.commands.run import find_case, verdict
from cases.programs import ROOT, name_of

LAUNCHER = ROOT / "grainpair"


def launch(*words, **options) -> subprocess.CompletedProcess:
    return subprocess.run(
        [LAUNCHER, *words], capture_output=True, text=True, timeout=600, **options
    )  # it may have to build


def test_help_lists_every_command():
    listed = launch("--help").stdout
    for file in (ROOT / "compare" / "commands").glob("[a-z]*.py"):
        assert re.search(rf"\n  {file.stem}\s", listed)


def test_unknown_command_is_bad_input():
    result = launch("rum")
    assert result.returncode == 2 and "invalid choice: 'rum'" in result.stderr


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
    # Outside pytest's folders, which only their owner can enter: nobody must be able to run the copy.
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)
        copy = Path(shutil.copy(LAUNCHER, folder))
        (Path(folder) / "packages.txt").write_text(
            "# needed\nbash\nno-such-package  # for a reason\nnor-such\n"
        )
        user = {"user": "nobody"} if os.getuid() == 0 else {}
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
    assert find_case("nowhere") == Path("nowhere")
    assert name_of(Path("mine.toml")) == "mine"
    assert name_of(ROOT / "cases" / "column" / "case.toml") == "column"


def test_verdict_is_five_lines_with_both_engines_and_their_difference():
    names = [
        "run_out",
        "final_height",
        "kinetic_energy_peak_time",
        "dissipated_energy",
        "cpu_seconds",
    ]
    metrics = {
        name: {"mpm": 1.1, "dem": 1.0, "relative_difference": 0.1, "unit": "L0"} for name in names
    }
    metrics["run_out"]["verdict"] = "within margin"
    metrics["final_height"]["mpm"] = metrics["final_height"][
        "relative_difference"
    ] = None  # a result without a number
    header, *lines = verdict(metrics).splitlines()
    assert header.split() == ["MPM", "DEM", "MPM/DEM", "-", "1"]
    assert len(lines) == 5
    assert lines[0].split() == ["run-out", "[L0]", "1.1", "1", "+10.0", "%", "within", "margin"]
    assert lines[1].split()[-3:] == ["-", "1", "-"]


@pytest.mark.parametrize(
    "word, start", [("geometry.height", "geometry.height "), ("column_ci", "title = ")]
)
def test_describe_knows_keys_and_cases(word, start):
    assert launch("describe", word).stdout.startswith(start)


def test_doctor_sets_nothing_up_and_says_what_is_there():
    result = launch("doctor")
    assert "engine liggghts" in result.stdout and "package cmake" in result.stdout
    assert result.returncode == (3 if "MISSING" in result.stdout else 0)
