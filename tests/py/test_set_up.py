"""What the launcher installs and builds for a command, what it says meanwhile; and that a run needs
no more than that.
"""

import csv
import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from synthetic import write_pair

from cases.programs import ROOT
from compare import targets

LISTS = sorted(ROOT.glob("packages*.txt"))
# Python's name of a package where that is another one than Debian's.
MODULES = {"python3-pytest-xdist": "xdist"}
# Not imported: Debian's Matplotlib asks for it or for SciPy.
STAND_INS = {"python3-munkres"}


def listed(file: Path) -> list[str]:
    return re.sub("#.*", "", file.read_text()).split()


def modules(file: Path) -> set[str]:
    """What Python may import of a list's packages."""
    return {
        MODULES.get(name, name.removeprefix("python3-"))
        for name in listed(file)
        if name.startswith("python3-") and name not in STAND_INS
    }


def test_each_package_is_on_one_list_alone():
    names = [name for file in LISTS for name in listed(file)]
    assert len(names) == len(set(names)) > 30


def test_every_list_is_asked_for_and_says_by_whom():
    asked = {"packages.txt", "packages-cluster.txt", "packages-laws.txt"}
    for file in targets.COMMANDS.glob("[a-z]*.py"):
        asked |= set(targets.packages([file.stem, "--quick", "--dump"]))
    assert asked == {file.name for file in LISTS}
    assert all(file.read_text().startswith("# What ") for file in LISTS)


@pytest.mark.parametrize(
    "line, lists, parts",
    [
        ("run", "", ""),
        ("run column --seeds 3", "", ""),
        ("compare runs/a", "", ""),
        ("compare runs/a --dump post", "studies", ""),
        ("frontier --profile slurm", "cluster", ""),
        ("frontier --profile=slurm", "cluster", ""),
        ("run --ranks 2", "cluster", "ranks"),
        ("run --progress-of-none", "", ""),
        ("export runs/a", "studies", None),
        ("law-test my.so", "", ""),
        ("law-test cases/laws/mohr_coulomb", "laws", "laws"),
        ("run --set material.library=hypoplastic", "laws", "laws"),
        ("describe cases/laws/mohr_coulomb", "", ""),
        ("bench", "studies", "benchmarks"),
        ("test", "laws studies test", "laws;tests;benchmarks"),
        ("test --only mu_i", "laws studies test", "tests"),
        ("check", "laws studies test cluster check", ""),
        ("docs", "docs", ""),
    ],
)
def test_a_command_line_asks_for_lists_and_parts_of_the_build(line, lists, parts):
    said = targets.plan(line.split())
    assert said[0].split() == ["packages.txt", *(f"packages-{name}.txt" for name in lists.split())]
    assert (said[5] if len(said) > 1 else None) == parts


def test_a_case_that_means_an_example_law_has_it_built(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text('[material]\nlaw = "external"\nlibrary = "libmine.so"\n')
    assert targets.targets(["run", str(tmp_path)]) == ["programs"]
    case.write_text('[material]\nlaw = "external"\nlibrary = "hypoplastic"\n')
    assert targets.targets(["run", str(tmp_path)]) == ["programs", "laws"]
    assert targets.targets(["run", "n" * 300]) == ["programs"]  # no name of a file


def test_what_needs_nothing_installs_nothing():
    assert targets.plan(["doctor"]) == targets.plan(["run", "--help"]) == targets.plan([]) == []


COMPARED = """
import json, sys
for name in {blocked}:
    sys.modules[name] = None
from compare.__main__ import main
code = main(["compare", {folder!r}, "--quiet"])
import compare.commands.run, dem_reference.run, dem_reference.ensemble
print(json.dumps([code, sorted(set(name.split(".")[0] for name in sys.modules))]))
"""


def test_a_run_imports_what_its_list_brings_and_no_more(tmp_path):
    own = modules(ROOT / "packages.txt")
    others = set().union(*map(modules, LISTS)) - own | {"scipy", "xarray", "websocket"}
    folder = write_pair(tmp_path / "pair", mpm={"frames": 5}, dem={"frames": 5})
    code = COMPARED.format(blocked=sorted(others), folder=str(folder))
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert done.returncode == 0, done.stderr
    exit_code, imported = json.loads(done.stdout.splitlines()[-1])
    assert exit_code in (0, 4)  # 4: a verdict that the synthetic pair is none is a result too
    assert (folder / "report.html").exists()
    # zstandard reads dumps, of compare --dump; all others are of any report.
    assert own <= set(imported) and {"scipy", "pytest", "hypothesis"} <= others


def test_the_readme_states_what_was_measured():
    with (ROOT / "docs" / "reference" / "first_step.csv").open() as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        value = {row["what"]: float(row["value"]) for row in rows if row["system"] == "Debian 12"}
    stated = (
        f"{value['download, git apart']:.0f} MB of download and "
        f"{value['on the disk, with git'] / 1000:.1f} GB of disk, and the first report is "
        f"there after {math.ceil(value['clone to first report, clock'] / 60):d} minutes"
    )
    assert stated in " ".join((ROOT / "README.md").read_text().split())


def configured(folder: Path, parts: str) -> subprocess.CompletedProcess:
    """CMake's answer where what tests, benchmarks and laws need is not to be found."""
    missing = [f"-DCMAKE_DISABLE_FIND_PACKAGE_{name}=ON" for name in ("GTest", "benchmark")]
    missing.append("-DCMAKE_Fortran_COMPILER=no-such-compiler")
    words = [
        "-S",
        str(ROOT),
        "-B",
        str(folder),
        "-G",
        "Ninja",
        f"-DGRAINPAIR_PARTS={parts}",
        *missing,
    ]
    return subprocess.run(["cmake", *words], capture_output=True, text=True, check=False)


def test_the_programs_are_built_without_what_tests_need(tmp_path):
    done = configured(tmp_path / "build", "")
    assert done.returncode == 0, done.stderr
    ninja = ["ninja", "-C", str(tmp_path / "build"), "-t", "inputs", "programs"]
    inputs = subprocess.run(ninja, capture_output=True, text=True, check=True).stdout
    assert "run_main.cpp" in inputs and "_test.cpp" not in inputs and ".f90" not in inputs


@pytest.mark.parametrize("part", ["laws", "tests", "benchmarks"])
def test_a_part_that_is_asked_for_must_build(part, tmp_path):
    assert configured(tmp_path / "build", part).returncode != 0


APT = """#!/bin/sh
[ "$1" = update ] && exit {update}
case " $* " in
  *" --assume-no "*)
    echo "0 upgraded, 8 newly installed, 0 to remove and 3 not upgraded."
    echo "Need to get 1,234 kB of archives."
    echo "After this operation, 5,678 kB of additional disk space will be used."
    exit 1 ;;
esac
for n in 1 2 3 4 5 6 7 8; do echo "Get:$n http://deb.debian.org/debian bookworm/main p$n"; done
for n in 1 2 3 4; do echo "Unpacking p$n (1.0) ..."; done
for n in 1 2; do echo "Setting up p$n (1.0) ..."; done
for n in 5 6 7 8; do echo "Unpacking p$n (1.0) ..."; done
for n in 3 4 5 6 7 8; do echo "Setting up p$n (1.0) ..."; done
echo "E: the last line"
exit {install}
"""


@pytest.fixture
def bare(tmp_path):
    """Runs the launcher as root of a machine on which no package is installed and apt-get is a
    script; of what it says, the lines.
    """
    tools = tmp_path / "tools"
    tools.mkdir()
    (tools / "dpkg-query").write_text("#!/bin/sh\n")
    (tools / "id").write_text("#!/bin/sh\necho 0\n")

    def run(*words: str, update=0, install=0, terminal=False) -> tuple[int, list[str]]:
        (tools / "apt-get").write_text(APT.format(update=update, install=install))
        for tool in tools.iterdir():
            tool.chmod(0o755)
        build = tmp_path / "elsewhere"
        build.mkdir(exist_ok=True)
        (build / "CMakeCache.txt").write_text("CMAKE_HOME_DIRECTORY:INTERNAL=/elsewhere\n")
        environment = os.environ | {
            "PATH": f"{tools}:{os.environ['PATH']}",
            "GRAINPAIR_BUILD": str(build),
            "TMPDIR": str(tmp_path),
        }
        command = [str(ROOT / "grainpair"), *words]
        if terminal:
            command = ["script", "-qec", " ".join(command), "/dev/null"]
        done = subprocess.run(
            command, capture_output=True, text=True, env=environment, timeout=60, check=False
        )
        said = done.stdout if terminal else done.stderr
        return done.returncode, said.splitlines()

    return run


def test_it_says_what_it_installs_how_much_and_how_far_it_is(bare):
    _, lines = bare("describe", "title")
    said = [line.removeprefix("grainpair: ") for line in lines if line.startswith("grainpair: ")]
    assert said[0].startswith("installing ") and "liggghts" in said[0] and "scipy" not in said[0]
    assert said[1:5] == [
        "reading Debian's lists of packages",
        "8 packages with all that they need: 1,234 kB to download, 5,678 kB on the disk",
        "downloading 1 of 8 packages",
        "downloading 2 of 8 packages",
    ]
    for step in ("downloading", "unpacking", "setting up"):
        counted = [line for line in said if line.startswith(f"{step} ")]
        assert counted == [f"{step} {n} of 8 packages" for n in (1, 2, 4, 6, 8)]


def test_on_a_terminal_the_count_stays_in_one_line(bare):
    _, lines = bare("describe", "title", terminal=True)
    counts = r"\x1b\[Kgrainpair: (?:downloading|unpacking|setting up) \d of 8 packages"
    assert len([line for line in lines if re.fullmatch(counts, line)]) == 24


@pytest.mark.parametrize("failing", ["update", "install"])
def test_packages_that_do_not_install_are_one_line_and_the_end_of_apts(bare, failing, tmp_path):
    code, lines = bare("describe", "title", **{failing: 100})
    assert code == 3
    assert re.fullmatch(r"grainpair: the packages did not install \(see \S+\)", lines[-1])
    log = Path(lines[-1].split()[-1].rstrip(")"))
    assert log.parent == tmp_path and log.exists()
    if failing == "install":
        assert lines[-2] == "E: the last line"


def test_users_are_told_the_lists_of_their_command_alone(bare, tmp_path):
    (tmp_path / "tools" / "id").write_text("#!/bin/sh\necho 1000\n")
    for words, there in ((["describe", "title"], False), (["export", "x"], True)):
        code, lines = bare(*words)
        assert code == 3 and lines[-1].startswith("grainpair: packages are missing. Install them")
        assert ("python3-meshio" in lines[-1]) == there and "snakemake" not in lines[-1]


def test_ranks_have_their_program_built_once_mpi_is_there(tmp_path, monkeypatch):
    monkeypatch.setattr(targets, "ready", lambda *_: True)
    monkeypatch.setenv("GRAINPAIR_BUILD", str(tmp_path))

    def state(*words) -> str:
        return targets.plan(["run", *words])[4]

    assert (state(), state("--ranks", "2")) == ("ready", "stale")
    (tmp_path / "mpm_run_ranks").touch()
    assert state("--ranks", "2") == "ready"
