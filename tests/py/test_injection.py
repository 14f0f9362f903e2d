"""Titles, names, folders and assignments that try to be commands are text to every command.

Each hostile text calls the program `injected`, which the tests put on PATH: it leaves a mark
wherever it is run. GRAINPAIR_INJECTION=all takes every text to every command, not only to the
quick ones.
"""

import ast
import html.parser
import io
import json
import os
import subprocess
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from xml.etree import ElementTree

import h5py
import pandas as pd
import pytest
from foreign_block import DT, write
from grains_file import SCENE, column, write_grains
from played_cluster import profile
from synthetic import CASE, write_pair

from cases import case, reading, workflow
from cases.errors import CaseError
from cases.programs import ROOT, module, plain, program
from cases.provenance import typed
from compare import __main__ as cli
from compare.report import report
from dem_reference import ensemble

CI = ROOT / "cases" / "column_ci"
THIN = "geometry.thickness=0.003"  # refused as soon as the grains have begun
REFUSED = "less than 2 grain diameters"
TEXTS = [
    "it's $(injected)",
    '"$(injected)"',
    "$(injected)",
    "`injected`",
    "'`injected`'",
    "; injected;",
    "';injected;'",
    '";injected;"',
    "&& injected",
    "|| injected #",
    "| injected",
    "& injected &",
    "\ninjected\n",
    "a\n$(injected)\nb",
    "\r\ninjected",
    "$((injected))",
    "${IFS}$(injected)",
    "<(injected)",
    "> injected; injected",
    "\\'; injected; \\'",
    '\\"; injected; \\"',
    "\nshell injected\n",
    '"\nshell injected\n"',
    "& \nshell injected",
    "x # y\nsystem 'injected'",
    "!injected",
    "{config} {injected} {0} {}",
    "{{ ''.__class__.__mro__ }} {% injected %}",
    "{{ 7 * 191 }}",
    "%s %(injected)s %n %d",
    "<script>injected()</script>",
    "<img src=x onerror=injected()>",
    "]]><iframe>&injected;</iframe>",
    '"><svg onload=injected()>',
    "&lt;b&gt; &#x3c;",
    "--set=title=injected",
    "-rf $(injected)",
    "__import__('os').system('injected')",
    "'); __import__('os').system('injected') #",
    "$\\frac$ $x_{injected}$ $",
    "é ü 砂 $(injected) \u202e\x1b[31m",
    "  $(injected)  ",
]
ALL = bool(os.environ.get("GRAINPAIR_INJECTION"))
FEW = range(len(TEXTS)) if ALL else (0,)
TOLD = ["--time-step", DT, "--density", 2500, "--gravity", 0, -9.81, 0]  # what a dump does not tell
STUDY = """
[error_bar]
timeout = 60.0
[[error_bar.scene]]
name = "coarse"
fine = 0.004
set."mpm.cell_size" = 0.004
"""
EVERYTHING = " ".join(TEXTS)


@pytest.fixture(scope="module")
def trap(tmp_path_factory):
    """A folder with the program `injected`, and the mark that it leaves."""
    folder = tmp_path_factory.mktemp("trap")
    mark = folder / "mark"
    (folder / "injected").write_text(f"#!/bin/sh\necho run >> {mark}\n")
    (folder / "injected").chmod(0o755)
    return folder, mark


@pytest.fixture(autouse=True)
def nothing_runs(trap, tmp_path, monkeypatch):
    folder, mark = trap
    monkeypatch.setenv("PATH", f"{folder}:{os.environ['PATH']}")
    monkeypatch.setenv("GRAINPAIR_RUNS", str(tmp_path / "runs"))
    monkeypatch.setenv("GRAINPAIR_BUILD", str(program("").resolve()))
    monkeypatch.chdir(tmp_path)
    yield
    assert not mark.exists()


def name(text: str) -> str:
    """As much of a text as a file can be called by."""
    return text.replace("/", "|").strip("\0")


def told(words: list) -> tuple[int, str, str]:
    """Exit code of a command of the launcher, and what it says on either stream."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        try:
            code = cli.main([str(word) for word in words])
        except SystemExit as end:
            code = int(end.code or 0)
    return code, out.getvalue(), err.getvalue()


def started(*words) -> subprocess.CompletedProcess:
    """A program of its own, for what is decided before our first line."""
    return subprocess.run(
        [str(word) for word in words], capture_output=True, text=True, timeout=120, check=False
    )


def is_line(said: str) -> bool:
    return said.endswith("\n") and said[:-1].isprintable()


class Page(html.parser.HTMLParser):
    """Elements and attributes of a page, and the text of its title and heading."""

    def __init__(self, text: str):
        super().__init__()
        self.elements: set[str] = set()
        self.attributes: set[str] = set()
        self.inside, self.said = "", {"title": "", "h1": ""}
        self.scripts: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.elements.add(tag)
        self.attributes |= {key for key, _ in attrs}
        self.inside = tag
        if tag == "script":
            self.scripts.append("")

    def handle_endtag(self, tag):
        self.inside = ""

    def handle_data(self, data):
        if self.inside in self.said:
            self.said[self.inside] += data
        if self.inside == "script":
            self.scripts[-1] += data

    def harmless(self, scripts: int = 0) -> bool:
        """Whether it has as many scripts as are ours, none of which holds a text of somebody's."""
        return (
            len(self.scripts) == scripts
            and not any("injected" in script for script in self.scripts)
            and "iframe" not in self.elements
            and not any(key.startswith("on") for key in self.attributes)
        )


def titled(text: str) -> dict:
    """Attributes of a run whose case has this title."""
    scene = CASE.replace('"Synthetic block"', json.dumps(text, ensure_ascii=False))
    sizes = {"height": 0.04, "length": 0.04, "thickness": 0.008, "floor_length": 1.0}
    for key, value in (sizes | {"void_ratio": 0.7}).items():
        scene = scene.replace(f"{{{key}}}", str(value))
    return {"case": scene, "case_resolved": case.parse(scene).resolved}


every = pytest.mark.parametrize("text", TEXTS, ids=ascii)
some = pytest.mark.parametrize("text", TEXTS[:: 1 if ALL else 4], ids=ascii)
few = pytest.mark.parametrize("text", [TEXTS[k] for k in FEW], ids=ascii)


def test_the_trap_catches(trap):
    """The control: shells that are handed the texts, and a page that shows them unescaped."""
    mark, caught = trap[1], 0
    for text in TEXTS:
        for line in (f"echo {text}", f"echo '{text}'", f'echo "{text}"'):
            subprocess.run(["bash", "-c", line], capture_output=True, check=False)
        caught += mark.exists()
        mark.unlink(missing_ok=True)
    assert caught >= 20, caught
    pages = [Page(f'<title>{text}</title><h1>{text}</h1><p title="{text}">') for text in TEXTS]
    assert sum(not page.harmless() for page in pages) >= 3


COMMANDS: dict[str, list[str]] = {  # and what each is told beside what it works on
    "run": ["--quiet", "--out", "out"],
    "compare": ["--quiet"],
    "map": ["--quiet"],
    "import": ["--quiet", "-o", "g.h5"],
}
for other in "export law-test collapse judge dimension element accuracy calibrate describe".split():
    COMMANDS[other] = []
for other in "frontier ladder atlas convergence error-bar".split():
    COMMANDS[other] = []


@every
def test_what_is_no_file_is_said_in_one_line(text):
    k = 0 if ALL else TEXTS.index(text)  # in CI every fifth command
    for command, words in list(COMMANDS.items())[k % 5 :: 1 if ALL else 5]:
        code, _, said = told([command, *words, "--", text])
        assert code in (2, 3) and is_line(said), (command, code, said)
    code, _, said = told([text])
    assert code == 2 and is_line(said), said


@every
def test_a_title_is_text_to_every_program(text, tmp_path):
    word = f"title={json.dumps(text, ensure_ascii=False)}"
    scene = case.load(CI, [word])
    assert scene["title"] == text
    again = tmp_path / name(text)[:60]
    again.write_text(scene.resolved)
    assert case.load(again)["title"] == text


@few
def test_a_title_is_text_to_the_engines(text, tmp_path):
    """Of both an output as short as can be, in a folder of that name, by a case file of it."""
    (folder := tmp_path / name(text)).mkdir()
    scene = folder / f"{name(text)}.toml"
    scene.write_text(case.load(CI, [f"title={json.dumps(text, ensure_ascii=False)}"]).resolved)
    words = [scene, "--set", "time.maximum=0.01", "-o"]
    mpm, dem = folder / f"{name(text)}.m.h5", folder / f"{name(text)}.d.h5"
    engines: dict[Path, list] = {mpm: [program("mpm_run")], dem: module("dem_reference.run")}
    for out, engine in engines.items():
        done = started(*engine, *words, out, "--quiet")
        assert done.returncode == 0, done.stderr
        with h5py.File(out) as file:
            assert case.parse(reading.attributes(file)["case"])["title"] == text
    assert not [*tmp_path.rglob("*.work"), *tmp_path.rglob("*scratch*")]


@every
def test_what_is_no_assignment_is_said_in_one_line(text):
    for word in (text, f"{text}=1", f"walls.gate={text}", f"time.maximum={text}"):
        with pytest.raises(CaseError) as refused:
            case.load(CI, [word])
        assert str(refused.value).isprintable()
    if ALL or text == TEXTS[0]:
        code, _, said = told(["run", CI, "--quiet", "--out", "out", "--set", THIN, "--set", text])
        assert code == 2 and is_line(said), said


@some
def test_grains_of_any_name_are_imported_and_exported(text, tmp_path):
    folder = tmp_path / name(text)
    folder.mkdir()
    dump, grains = folder / f"{name(text)}.dump", folder / f"{name(text)}.h5"
    code, _, said = told(["import", write(dump), "-o", grains, "--quiet", *TOLD])
    assert code == 0 and not said, said
    code, _, said = told(["export", grains])
    if "\x1b" in text:  # no XML 1.0 holds it
        assert code == 2 and "rename it" in said and is_line(said)
        return
    assert code == 0 and not said, said
    listing = ElementTree.parse(folder / "vtk" / f"{grains.stem}.pvd").getroot()
    files = [one.get("file") for one in listing.iter("DataSet")]
    assert len(files) == 3 and all((folder / "vtk" / str(one)).exists() for one in files)
    tree = ast.parse((folder / "vtk" / "open_in_paraview.py").read_text())
    (scene,) = (one.value for one in tree.body if isinstance(one, ast.AnnAssign) and one.value)
    shown = ast.literal_eval(scene)
    assert shown["folder"] == str(folder / "vtk")
    assert [side["name"] for side in shown["sides"]] == [grains.stem]


@pytest.fixture
def pair(tmp_path):
    """Makes mpm.h5 and dem.h5 of a title in a folder of a name."""

    def make(title: str, place: str) -> Path:
        more = {"frames": 3, "attributes": titled(title)}
        return write_pair(tmp_path / name(place), mpm=more, dem=more | {"stretch": 2.1})

    return make


def shown(page: Path, title: str, scripts: int = 0):
    """The title is on the page as text, and nothing but our own elements is."""
    found = Page(page.read_text())
    assert found.harmless(scripts)
    assert found.said["title"].split() == found.said["h1"].split() == title.split()


@few
def test_a_report_shows_a_title_as_text(text, pair, monkeypatch):
    if not ALL:  # figures take their time, and hold no title of a case
        draw = report.draw_all
        monkeypatch.setattr(report, "draw_all", lambda charts, *more: draw(charts[:1], *more))
    folder = pair(text if ALL else EVERYTHING, text)
    code, _, said = told(["compare", folder, "--quiet"])
    assert code in (0, 4) and not said, said
    player = (ROOT / "compare/report/player/player.html.j2").read_text().count("<script")
    shown(folder / "report.html", text if ALL else EVERYTHING, player)
    for figure in (folder / "figures").glob("*.svg"):
        assert not [one for one in ElementTree.parse(figure).iter() if "script" in one.tag]


@few
def test_a_map_shows_a_name_as_text(text, tmp_path):
    grains = write_grains(tmp_path / f"{name(text)}.h5", [column(force=1e-4)], **SCENE)
    code, _, said = told(["map", grains, "--quiet", "--out", tmp_path / "out"])
    assert code == 0 and not said, said
    assert Page((tmp_path / "out" / "map.html").read_text()).harmless()


def scene_in(folder: Path, title: str) -> Path:
    folder.mkdir(parents=True)
    title = json.dumps(title, ensure_ascii=False)
    (folder / "case.toml").write_text(f'extends = "{CI}/case.toml"\ntitle = {title}\n')
    return folder


@few
def test_jobs_of_an_ensemble_are_told_no_text(text, tmp_path):
    scene = scene_in(tmp_path / name(text), EVERYTHING)
    words = ["--seeds", 1, "--quiet", "--set", THIN, "--table", tmp_path / f"{name(text)}.csv"]
    done = started(*module("dem_reference.ensemble", scene, *words))
    assert done.returncode == 3 and REFUSED in done.stderr and is_line(done.stderr), done.stderr


@few
def test_jobs_of_a_cluster_are_told_no_text(text, tmp_path):
    """Here Snakemake writes shell scripts."""
    pytest.importorskip("snakemake")
    scene = scene_in(tmp_path / name(text), EVERYTHING)
    words = ["--seeds", 1, "--quiet", "--set", THIN, "--profile", profile(tmp_path)]
    done = started(*module("dem_reference.ensemble", scene, *words, "--table", tmp_path / "t.csv"))
    assert done.returncode == 3 and REFUSED in done.stderr and is_line(done.stderr), done.stderr


@pytest.mark.parametrize("text", [text for text in TEXTS if not plain(name(text))], ids=ascii)
def test_a_folder_that_a_cluster_cannot_be_told_is_refused(text, tmp_path, monkeypatch):
    monkeypatch.setenv("GRAINPAIR_RUNS", str(tmp_path / name(text)))
    with pytest.raises(CaseError, match="cannot be told to a cluster"):
        ensemble.make(case.load(CI), [], range(1, 2), workflow.Where(1, tmp_path))


@few
def test_a_study_in_any_folder(text, tmp_path):
    scene = scene_in(tmp_path / name(text), EVERYTHING)
    (scene / "study.toml").write_text(STUDY)
    code, _, said = told(["error-bar", scene, "--jobs", 1, "--quiet", "--out", tmp_path / "out"])
    assert code == 3 and "four cells each way" in said and is_line(said), said


@few
def test_tables_keep_a_command_in_its_line_and_quoted(text, tmp_path):
    words = ["--set", f"title={json.dumps(text, ensure_ascii=False)}"]
    table = tmp_path / "table.csv"
    ensemble.save(pd.DataFrame({"seed": [1]}), table, typed("python3 -m x", words))
    lines = table.read_text().splitlines()
    assert [line for line in lines if not line.startswith("# ")] == ["seed", "1"]
    (command,) = (line for line in lines if line.startswith("# command: "))
    subprocess.run(["bash", "-c", command.removeprefix("# command: python3 -m x")], check=False)
