"""A folder of results has one owner, and an earlier result stands until the new one is complete."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from cases import files, results, room, scratch
from cases.errors import CaseError, EngineError
from cases.programs import ROOT
from compare import __main__ as cli
from compare.commands import run as run_command
from dem_reference import packing

# Stand-ins for a run that works for long: what they hold, and the words they say when they do.
HOLDERS = {
    "results": "results.prepared(Path(sys.argv[1]), ['report.html'])",
    "file": "files.owned(Path(sys.argv[1]))",
    "packing": "scratch.scratch(Path(sys.argv[1]), 'packing')",
}
HOLD = """
import sys, time
from pathlib import Path
from cases import files, results, scratch
with {holder} as work:
    (work / "half" if work.is_dir() else work).write_text("half")
    print("ready", flush=True)
    time.sleep(600)
"""


@pytest.fixture
def hold():
    """Starts a stand-in and waits until it works."""
    started = []

    def start(holder: str, place: Path) -> subprocess.Popen:
        words = [sys.executable, "-c", HOLD.format(holder=HOLDERS[holder]), str(place)]
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
        one = subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=environment)
        started.append(one)
        assert one.stdout and one.stdout.readline() == "ready\n"
        return one

    yield start
    for one in started:
        one.kill()
        one.wait()


def listing(folder: Path) -> dict[str, str]:
    """Every file below a folder, hidden ones too, with its text."""
    return {
        str(path.relative_to(folder)): path.read_text(errors="replace") if path.is_file() else ""
        for path in folder.rglob("*")
    }


def fill(folder: Path, **texts: str) -> Path:
    for name, text in texts.items():
        path = folder / name.replace("__", "/").replace("_html", ".html")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


@pytest.mark.parametrize("holder", ["results", "file"])
def test_a_second_owner_is_refused_and_told_of_the_first(tmp_path, hold, holder):
    out = tmp_path / "result"
    first = hold(holder, out)
    taking = results.prepared(out) if holder == "results" else files.owned(out)
    with pytest.raises(CaseError) as refused, taking:
        pass
    line = str(refused.value)
    assert line.startswith(f"{out}: in use by process {first.pid} (started ") and "\n" not in line


def test_a_link_to_the_folder_is_the_folder(tmp_path, hold):
    out = fill(tmp_path / "result", report_html="old")
    (tmp_path / "link").symlink_to(out)
    hold("results", out)
    with pytest.raises(CaseError, match="in use"), results.prepared(tmp_path / "link"):
        pass


@pytest.mark.parametrize("command", [["compare"], ["export"], ["run", "column_ci", "--out"]])
def test_whatever_writes_into_the_folder_asks_for_it(tmp_path, hold, command, capsys):
    out = fill(tmp_path / "result", report_html="old")
    (out / "mpm.h5").write_text("")
    hold("results", out)
    assert cli.main([*command, str(out)]) == 2
    assert capsys.readouterr().err.startswith(f"{out}: in use by process")


@pytest.mark.parametrize("holder", HOLDERS)
def test_a_killed_run_leaves_the_earlier_result_and_the_next_clears_up(tmp_path, hold, holder):
    out = tmp_path / "result"
    if holder != "file":
        fill(out, report_html="old", note="mine")
    before = listing(tmp_path)
    dead = hold(holder, out)
    dead.kill()
    dead.wait()
    left = listing(tmp_path)
    assert left.items() > before.items()  # nothing of the earlier result is gone
    if holder == "results":
        with results.prepared(out) as work:
            (work / "report.html").write_text("new")
        assert listing(tmp_path) == before | {"result/report.html": "new"}
    elif holder == "file":
        with files.owned(out) as part:
            part.write_text("new")
        assert listing(tmp_path) == {"result": "new"}
    else:
        with scratch.scratch(out, "packing"):
            pass
        assert listing(tmp_path) == before


def test_only_what_dead_runs_have_left_is_removed(tmp_path, hold):
    living, dead = hold("packing", tmp_path), hold("packing", tmp_path)
    dead.kill()
    dead.wait()
    assert len(list(tmp_path.glob(".packing.scratch-*/files/half"))) == 2
    with scratch.scratch(tmp_path, "packing"):
        pass
    assert len(list(tmp_path.glob(".packing.scratch-*/files/half"))) == 1
    assert living.poll() is None


def test_the_store_of_packings_is_cleared_by_the_next_that_is_made(tmp_path, hold, monkeypatch):
    case = {"dem": {"packing_attempts": 1, "packing_friction": 1.0, "packing_damping": 1.0}}
    case["initial"] = {"void_ratio": 0.7}
    dead = hold("packing", tmp_path)
    dead.kill()
    dead.wait()

    def fail(*_, **__):
        raise EngineError("stopped")

    for name in ("time_step", "run_engine"):
        monkeypatch.setattr(packing, name, fail if name == "run_engine" else lambda *_: 0.0)
    monkeypatch.setattr(packing, "packing_key", lambda *_: "key")
    monkeypatch.setattr(packing, "dict_of", lambda one: one)
    monkeypatch.setattr(packing.Grains, "of", lambda *_: None)
    case["geometry"] = {"height": 1.0, "gravity": 1.0}
    case["dem"]["time_step_fraction"] = 0.1
    with pytest.raises(EngineError, match="stopped"):
        packing.obtain(case, 1, tmp_path, lambda *_: None)
    assert not listing(tmp_path)


def inside(monkeypatch, out):
    monkeypatch.chdir(out)


def without_links(monkeypatch, out):
    def refuse(*_, **__):
        raise PermissionError(1, "no links here")

    monkeypatch.setattr(results.os, "link", refuse)


def without_exchange(monkeypatch, out):
    monkeypatch.setattr(results, "exchanged", lambda *_: False)


def of_its_own_file_system(monkeypatch, out):
    monkeypatch.setattr(results, "home_of", lambda real: real)


WAYS = [lambda *_: None, inside, without_links, without_exchange, of_its_own_file_system]


@pytest.mark.parametrize("way", WAYS)
def test_new_results_replace_ours_and_keep_what_others_put_there(tmp_path, monkeypatch, way):
    out = fill(
        tmp_path / "result",
        report_html="old",
        stale="old",
        figures__gone="old",
        vtk__mpm__1="old",
        vtk__notes="mine",
        note="mine",
        deep__er__note="mine",
    )
    (out / "link").symlink_to("note")
    way(monkeypatch, out)
    with results.prepared(out, ["report.html", "stale", "figures", "vtk/mpm"]) as work:
        fill(work, report_html="new", figures__made="new", vtk__mpm__2="new", deep__new="new")
        assert (out / "report.html").read_text() == "old"  # until all is there
    found = listing(out)
    assert {name: text for name, text in found.items() if text} == {
        "report.html": "new",
        "figures/made": "new",
        "vtk/mpm/2": "new",
        "deep/new": "new",
        "vtk/notes": "mine",
        "note": "mine",
        "deep/er/note": "mine",
        "link": "mine",
    }
    assert (out / "link").is_symlink()
    assert [path.name for path in tmp_path.iterdir()] == ["result"]


def test_a_block_that_fails_leaves_the_folder_as_it_was(tmp_path):
    out = fill(tmp_path / "result", report_html="old")
    before = listing(tmp_path)
    with pytest.raises(EngineError, match=f"{out}/mpm.h5: broken"), results.prepared(out) as work:
        fill(work, report_html="new")
        raise EngineError(f"{work}/mpm.h5: broken")
    assert listing(tmp_path) == before
    with pytest.raises(EngineError), results.prepared(tmp_path / "new" / "result"):
        raise EngineError("stopped")
    assert listing(tmp_path) == before


def test_results_that_cannot_take_their_place_are_kept_and_said_to_be(tmp_path, monkeypatch):
    out = fill(tmp_path / "result", report_html="old")

    def refuse(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(results, "exchanged", refuse)
    with pytest.raises(EngineError, match="No space left.* are in .*result-new"):
        with results.prepared(out) as work:
            fill(work, report_html="new")
    assert (out / "report.html").read_text() == "old"
    assert (tmp_path / "result-new" / "report.html").read_text() == "new"


def a_file(folder: Path) -> Path:
    (folder / "file").write_text("mine")
    return folder / "file"


def a_dangling_link(folder: Path) -> Path:
    (folder / "link").symlink_to("nowhere")
    return folder / "link"


def a_loop(folder: Path) -> Path:
    (folder / "loop").symlink_to("loop")
    return folder / "loop"


NO_PLACES = {
    "a file": a_file,
    "below a file": lambda folder: a_file(folder) / "result",
    "a dangling link": a_dangling_link,
    "a link loop": a_loop,
    "a name too long": lambda folder: folder / ("x" * 300),
    "no room for our own names": lambda folder: folder / ("x" * 250),
    "the kernel's": lambda folder: Path("/proc/x"),
    "read-only": lambda folder: Path("/sys/kernel"),
    "the root": lambda folder: Path("/"),
}


def no_engine(*_, **__):
    raise AssertionError("an engine was started")


@pytest.mark.parametrize("what", NO_PLACES)
def test_a_place_for_no_results_is_refused_before_an_engine_starts(
    tmp_path, monkeypatch, capsys, what
):
    out = NO_PLACES[what](tmp_path)
    before = listing(tmp_path)
    monkeypatch.setattr(run_command, "run_stages", no_engine)
    assert cli.main(["run", "column_ci", "--quiet", "--out", str(out)]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1 and said.err.startswith(f"{out}: ")
    assert "choose another place" in said.err
    assert listing(tmp_path) == before


def test_no_room_is_refused_before_an_engine_starts(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(run_command, "run_stages", no_engine)
    monkeypatch.setattr(room, "free", lambda _: 1_000_000)
    assert cli.main(["run", "column_ci", "--quiet", "--out", str(tmp_path / "result")]) == 3
    line = capsys.readouterr().err
    assert "no room (needs about" in line and "MB, 1 MB free)" in line and line.count("\n") == 1
    assert not list(tmp_path.iterdir())


def replace_engines(monkeypatch, comparison):
    """Engines that write their files, and a comparison that ends so."""

    def engines(chains, **_):
        for stage in (stage for chain in chains for stage in chain):
            Path(stage.command[stage.command.index("-o") + 1]).write_text(stage.name)
        return {}

    def compare(stages, **_):
        (stage,) = stages
        comparison(stage.command[stage.command.index("--progress") - 1])

    monkeypatch.setattr(run_command, "run_chains", engines)
    monkeypatch.setattr(run_command, "run_stages", compare)


def test_a_comparison_that_fails_loses_neither_the_old_report_nor_the_new_runs(
    tmp_path, monkeypatch, capsys
):
    out = fill(tmp_path / "result", report_html="old")

    def fail(folder):
        raise EngineError("grain_map: failed")

    replace_engines(monkeypatch, fail)
    assert cli.main(["run", "column_ci", "--quiet", "--no-siblings", "--out", str(out)]) == 3
    line = capsys.readouterr().err
    assert line.startswith("grain_map: failed; the engines' results are in ")
    assert listing(out) == {"report.html": "old"}
    assert set(listing(tmp_path / "result-not-compared")) == {"mpm.h5", "dem.h5"}


def test_a_name_that_begins_with_a_dash_is_a_name(tmp_path, monkeypatch, capsys):
    def compare(folder):
        assert Path(folder).is_absolute()
        entry = {"mpm": 1.0, "dem": 1.0, "relative_difference": 0.0, "unit": "-"}
        softness = ("softening_error", "weight_to_stiffness")
        metrics = {name: entry for name in (*run_command.VERDICT, *softness)} | {
            "verdict": {"value": "agree", "valid": True, "scatter": "none"},
            "findings": {"list": []},
        }
        (Path(folder) / "metrics.json").write_text(json.dumps(metrics))

    monkeypatch.chdir(tmp_path)
    replace_engines(monkeypatch, compare)
    assert (
        cli.main(["run", "column_ci", "--quiet", "--no-siblings", "--out=-dash"]) == 0
    ), capsys.readouterr().err
    assert set(listing(tmp_path / "-dash")) == {"mpm.h5", "dem.h5", "metrics.json"}


def test_an_interrupted_owner_lets_go(tmp_path, hold):
    out = fill(tmp_path / "result", report_html="old")
    before = listing(tmp_path)
    one = hold("results", out)
    one.send_signal(signal.SIGINT)
    one.wait(timeout=30)
    assert listing(tmp_path) == before
