"""Nothing of the caller's surroundings decides what runs: neither files of the working folder nor
his packages, variables, or another python3 on PATH.
"""

import os
import re
import shutil
import subprocess
from pathlib import Path

import clones
import pytest

from cases.programs import PYTHON, ROOT, module, program
from cases.reading import attributes
from cases.start import FOREIGN, clean

CI = ROOT / "cases" / "column_ci"
THIN = ("--set", "geometry.thickness=0.003")  # refused as soon as the grains have begun
SAID = "less than 2 grain diameters"
CRY = "raise SystemExit('{} was imported')\n"
MODULES = ("signal", "compare", "cases", "numpy", "argparse", "usercustomize", "sitecustomize")


@pytest.fixture
def hostile(tmp_path):
    """A working folder full of traps, and the variables that lead to them."""
    folder, home = tmp_path / "here", tmp_path / "home"
    version = subprocess.run(
        [PYTHON, "-c", "import sys; print('python%d.%d' % sys.version_info[:2])"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()
    for place in (folder, home / ".local" / "lib" / version / "site-packages"):
        place.mkdir(parents=True)
        for name in MODULES:
            (place / f"{name}.py").write_text(CRY.format(name))
    tools = tmp_path / "tools"
    tools.mkdir()
    for name in ("python3", "snakemake", "python"):
        (tools / name).write_text(f"#!/bin/sh\necho fake {name} >&2; exit 9\n")
        (tools / name).chmod(0o755)
    (folder / "startup.sh").write_text("echo startup.sh was read >&2; exit 9\n")
    environment = {
        "PATH": f"{tools}:{os.environ['PATH']}",
        "HOME": str(home),
        "PYTHONPATH": str(folder),
        "PYTHONHOME": "/nonexistent",
        "PYTHONSTARTUP": str(folder / "signal.py"),
        "PYTHONWARNINGS": "error",
        "BASH_ENV": str(folder / "startup.sh"),
        "BASH_FUNC_cd%%": "() { echo cd was called >&2; exit 9; }",
        "CDPATH": "/",
        "MPLBACKEND": "nonsense",
        "SNAKEMAKE_PROFILE": "nonsense",
        "GRAINPAIR_RUNS": str(tmp_path / "runs"),
        "GRAINPAIR_BUILD": str(clones.built(tmp_path / "build")),
    }
    return folder, environment


def test_the_launcher_and_what_it_starts_are_apart(hostile):
    folder, environment = hostile
    shown = clones.call([ROOT / "grainpair", "describe", "walls.gate_speed"], folder, **environment)
    assert (shown.returncode, shown.stderr) == (0, "")
    run = [ROOT / "grainpair", "run", CI, "--quiet", "--out", "result", *THIN]
    for words in (run, [*run, "--seeds", "2"]):  # grains alone, and as jobs beside each other
        refused = clones.call(words, folder, **environment)
        assert SAID in refused.stderr and refused.stderr.count("\n") == 1, refused.stderr
        assert refused.returncode in (2, 3)


def test_a_module_that_is_typed_starts_anew_apart_from_the_users_packages(hostile, tmp_path):
    folder, environment = hostile
    home = {name: environment[name] for name in ("HOME", "GRAINPAIR_BUILD", "GRAINPAIR_RUNS")}
    for trap in ("usercustomize.py", "sitecustomize.py"):  # which Python runs before all else
        next(Path(home["HOME"]).rglob(trap)).unlink()
    words = ["-m", "dem_reference.run", CI, "-o", tmp_path / "dem.h5", *THIN]
    refused = clones.call([PYTHON, *words], ROOT, **home)
    assert (refused.returncode, refused.stderr.count("\n")) == (2, 1), refused.stderr
    assert SAID in refused.stderr


def test_a_module_that_is_typed_leaves_another_python(tmp_path):
    """Any that can read our sources hands over to Debian's: here one without its packages."""
    bare = tmp_path / "bin" / "python3"
    subprocess.run([PYTHON, "-m", "venv", "--without-pip", tmp_path], check=True, timeout=60)
    helped = clones.call([bare, "-m", "dem_reference.run", "--help"], ROOT)
    assert helped.returncode == 0 and "--ranks" in helped.stdout, helped.stderr


def test_every_process_of_ours_is_started_by_one_function():
    """No other place puts python and -m together, in Python or in a Snakefile."""
    sources = [*ROOT.glob("*/**/*.py"), *ROOT.glob("*/**/Snakefile"), ROOT / "grainpair"]
    own = ROOT / "cases" / "programs.py"
    for file in sources:
        if "tests" in file.parts or file == own:
            continue
        by_hand = r'sys\.executable|/usr/bin/python3 -m|"-m",\s*"(dem_reference|compare|cases)\b'
        assert not re.search(by_hand, file.read_text()), file


def test_foreign_variables_are_dropped_and_folders_are_complete(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    names = [f"{start}X" for start in FOREIGN]
    environment = dict.fromkeys([*names, "PATH"], "x") | {"GRAINPAIR_RUNS": "mine"}
    clean(environment)
    assert environment == {"PATH": "x", "GRAINPAIR_RUNS": str(tmp_path / "mine")}


def test_figures_do_not_look_as_the_working_folder_says(tmp_path):
    (tmp_path / "matplotlibrc").write_text("lines.markersize: 99\nxtick.major.size: 77\n")
    told = "import cases.style, matplotlib; print(matplotlib.rcParams['lines.markersize'])"
    shown = clones.call([PYTHON, "-c", told], tmp_path, PYTHONPATH=str(ROOT), HOME=str(tmp_path))
    assert float(shown.stdout) == 6.0


@pytest.fixture(scope="module")
def german(tmp_path_factory):
    """A locale with a decimal comma and another encoding than UTF-8, and where it is."""
    folder = tmp_path_factory.mktemp("locales")
    made = folder / "de_DE.ISO-8859-1"
    if not shutil.which("localedef") or not Path("/usr/share/i18n/locales/de_DE").exists():
        pytest.skip("the package locales is not installed")
    subprocess.run(["localedef", "-i", "de_DE", "-f", "ISO-8859-1", made], check=True)
    return {"LOCPATH": str(folder), "LC_ALL": made.name}


def test_numbers_and_text_are_read_alike_in_every_locale(german, tmp_path):
    import h5py

    text = f'title = "Säule – 1,5 √2"\nextends = "{CI}/case.toml"\n[time]\nmaximum = 0.25\n'
    case = tmp_path / "case.toml"
    case.write_text(text, encoding="utf-8")
    found = {}
    for name, locale in {"german": german, "plain": {"LANG": "C"}}.items():
        around = {"GRAINPAIR_BUILD": str(program("").resolve()), "HOME": str(tmp_path)} | locale
        mpm, dem = tmp_path / f"{name}_mpm.h5", tmp_path / f"{name}_dem.h5"
        for words in (
            [program("mpm_run").resolve(), case, "-o", mpm, "--quiet"],
            module("dem_reference.run", case, "-o", dem, "--packings", tmp_path / "packings"),
        ):
            done = clones.call(words, tmp_path, **around)
            assert (done.returncode, done.stderr) == (0, ""), done.stderr
        for file in (mpm, dem):
            with h5py.File(file) as result:
                assert attributes(result)["case"] == text
                found[file.name] = result["energy/potential"][()].tolist()
    assert found["german_mpm.h5"] == found["plain_mpm.h5"]
    assert found["german_dem.h5"] == found["plain_dem.h5"]
