"""A clone that is somebody else's: it is used and not written."""

import os
import tempfile
from pathlib import Path

import clones
import pytest

from cases import programs
from cases.errors import CaseError
from cases.programs import ROOT, module
from compare import targets

CI = ("cases", "column_ci")


@pytest.fixture(scope="module")
def theirs():
    """A clone that nobody may write, a build of another clone, and a folder to work in.

    Outside pytest's folders, which only their owner can enter.
    """
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)
        clone = clones.copied(Path(folder) / "clone")
        build = clones.built(Path(folder) / "build")
        inside = clone / "build" / "release"
        inside.mkdir(parents=True)
        (inside / "mpm_case").symlink_to(build / "mpm_case")
        (inside / "CMakeCache.txt").write_text(f"CMAKE_HOME_DIRECTORY:INTERNAL={clone}\n")
        (inside / "built").mkdir()
        (inside / "built" / "mpm_case").write_text(targets.sources(clone))
        work = Path(folder) / "work"
        work.mkdir()
        work.chmod(0o777)
        locked = [clone, *clone.rglob("*")]
        for path in locked:
            if not path.is_symlink():
                path.chmod(path.stat().st_mode & ~0o222)
        yield clone, build, work
        for path in locked:
            if path.is_dir():
                path.chmod(0o755)


def private(folder: Path) -> Path:
    return folder / f"grainpair-{65534 if os.getuid() == 0 else os.getuid()}"


@pytest.mark.parametrize(
    "words", [["--version"], ["run", "--help"], ["describe", "title"]], ids=str
)
def test_what_needs_nothing_built_touches_nothing(theirs, words):
    """And a build of the same sources is used as it is, without a lock."""
    clone, _, work = theirs
    done = clones.call([clone / "grainpair", *words], work, user="nobody", TMPDIR=str(work))
    assert (done.returncode, done.stderr) == (0, "")
    assert not list(work.iterdir()) and not (clone / "build" / "release" / "lock").exists()


def test_a_build_of_other_sources_is_told_from_ours(theirs):
    clone, _, work = theirs
    around = {"TMPDIR": str(work), "GRAINPAIR_BUILD": str(clone / "build" / "release")}
    done = clones.call([clone / "grainpair", "run"], work, user="nobody", **around)
    assert done.returncode == 3 and done.stderr.count("\n") == 1
    assert "lacks programs of these sources, and cannot be written" in done.stderr


def test_without_a_home_what_is_kept_goes_to_a_private_folder(theirs):
    clone, build, work = theirs
    words = module("dem_reference.run", clone.joinpath(*CI), "-o", "dem.h5", "--set")
    words[4] = str(clone / "cases" / "start.py")
    around = {"TMPDIR": str(work), "GRAINPAIR_BUILD": str(build), "LANG": "C"}
    done = clones.call([*words, "time.maximum=0.25"], work, user="nobody", **around)
    folder = private(work)
    assert done.returncode == 0, done.stderr
    assert done.stderr == (
        f"grainpair: no home folder, so what is built and kept goes to {folder}\n"
    )
    assert folder.stat().st_mode & 0o777 == 0o700
    assert list(folder.glob("grainpair/*/runs/packings/*/packing.h5"))
    left = {path.name for path in work.iterdir() if not path.name.startswith("ompi.")}  # MPI's own
    assert left == {folder.name, "dem.h5"}


def test_a_stand_in_for_a_home_that_others_may_write_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.delenv("HOME", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    folder = tmp_path / f"grainpair-{os.getuid()}"
    folder.mkdir()
    folder.chmod(0o777)
    with pytest.raises(CaseError, match="others may write there"):
        programs.user_cache(make=True)
    folder.chmod(0o700)
    assert programs.user_cache(make=True) == folder
    folder.rmdir()
    folder.symlink_to("/tmp")
    with pytest.raises(CaseError, match="others may write there"):
        programs.user_cache(make=True)


def test_where_an_install_writes(tmp_path, monkeypatch):
    """In the clone; else in the user's cache, under a name of this clone's own."""
    monkeypatch.delenv("GRAINPAIR_RUNS", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert programs.kept("packings") == ROOT / "runs" / "packings"
    monkeypatch.setattr(programs, "can_write", lambda path: not path.is_relative_to(ROOT))
    ours = programs.kept("packings")
    assert ours.is_relative_to(tmp_path / "grainpair")
    assert programs.own("build", "element").is_relative_to(ours.parents[1])
    monkeypatch.setattr(programs, "ROOT", tmp_path / "another")
    assert programs.of_this_clone(tmp_path) != ours.parents[1]


def test_a_changed_source_makes_a_build_stale(tmp_path):
    (tmp_path / "cases").mkdir()
    source = tmp_path / "cases" / "case.cpp"
    source.write_text("int a;")
    record = tmp_path / "built" / "programs"
    record.parent.mkdir()
    record.write_text(targets.sources(tmp_path) + "\n")
    assert targets.ready(tmp_path, ["programs"], targets.sources(tmp_path))
    assert targets.ready(tmp_path, ["mpm_case"], targets.sources(tmp_path))
    assert not targets.ready(tmp_path, ["all"], targets.sources(tmp_path))
    source.write_text("int b;")
    assert not targets.ready(tmp_path, ["programs"], targets.sources(tmp_path))


def test_an_install_leads_to_the_clone(tmp_path):
    """By CMake's script, as `cmake --install` runs it; then from another folder, by its path."""
    prefix, home = tmp_path / "usr", tmp_path / "home"
    home.mkdir()
    script = ROOT / "compare" / "shell" / "install.cmake"
    call = ["cmake", f"-DCMAKE_INSTALL_PREFIX={prefix}", "-P", script]
    assert clones.call(call, tmp_path, HOME=str(home)).returncode == 0
    shown = clones.call([prefix / "bin" / "grainpair", "--version"], home)
    assert shown.returncode == 0 and shown.stdout.startswith("grainpair ")
    assert (prefix / "share" / "man" / "man1" / "grainpair.1").read_text().startswith(".TH")
    script = prefix / "share" / "bash-completion" / "completions" / "grainpair"
    assert clones.call(["bash", "-n", script], home).returncode == 0
    (modules,) = prefix.glob("lib/python3.*/dist-packages")
    asked = f"import site; site.addsitedir({str(modules)!r}); import grainpair; print(grainpair)"
    found = clones.call(["/usr/bin/python3", "-c", asked], home, HOME=str(home))
    assert str(ROOT / "compare" / "python" / "grainpair") in found.stdout, found.stderr
    again = clones.call(call, tmp_path, HOME=str(home))
    assert again.returncode == 0  # over an earlier one


def test_a_prefix_that_cannot_be_written_is_a_line(tmp_path):
    (tmp_path / "usr").touch()
    done = clones.call(module("compare.shell.install", tmp_path / "usr"), tmp_path)
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert "cannot be installed to" in done.stderr


def test_the_users_own_prefix_has_the_users_own_modules(monkeypatch):
    from compare.shell import install

    monkeypatch.setattr(install.site, "getuserbase", lambda: "/home/a/.local")
    monkeypatch.setattr(install.site, "getusersitepackages", lambda: "/home/a/.local/lib/p/s")
    assert install.modules(Path("/home/a/.local")) == Path("/home/a/.local/lib/p/s")
    assert install.modules(Path("/usr/local")).name == "dist-packages"
