"""Completion in a real bash, the manual page under man's own warnings; words that are misspelt."""

import json
import re
import shutil
import subprocess

import pytest

from cases import case
from cases.errors import CaseError
from cases.lookup import find_case, meant
from cases.programs import ROOT, module
from compare.pages import scenes
from compare.parsers import files
from compare.shell import completion, man, surface
from compare.targets import targets

# Words as bash splits them: = is one of its own.
DRIVE = """
source {script}
COMP_WORDBREAKS=$' \\t\\n"\\'><=;|&(:'
COMP_WORDS=({words})
COMP_CWORD={last}
COMP_LINE="${{COMP_WORDS[*]}}" COMP_POINT=${{#COMP_LINE}}
_grainpair grainpair "" ""
printf '%s\\n' "${{COMPREPLY[@]}}"
"""


@pytest.fixture(scope="module")
def known():
    return surface.commands()


@pytest.fixture(scope="module")
def complete(known, tmp_path_factory):
    """What bash offers after some words, the last of which is begun."""
    folder = tmp_path_factory.mktemp("completion")
    (folder / "script").write_text(completion.script("bash", known))
    (folder / "mine.toml").touch()
    (folder / "results").mkdir()

    def offered(*words: str) -> set[str]:
        quoted = " ".join(f"'{word}'" for word in ("grainpair", *words))
        line = DRIVE.format(script=folder / "script", words=quoted, last=len(words))
        shell = ["bash", "--norc", "-c", line]
        done = subprocess.run(shell, capture_output=True, text=True, cwd=folder, timeout=60)
        assert (done.returncode, done.stderr) == (0, "")
        return set(done.stdout.split())

    return offered


def test_commands_are_offered(complete):
    assert complete("") == set(files())
    assert complete("desc") == {"describe"}
    assert complete("nosuch") == set()


def test_every_option_of_every_command_is_offered(complete, known):
    for command in known:
        flags = {flag for one in command.options for flag in one.flags if flag.startswith("--")}
        assert complete(command.name, "--") == flags, command.name
    assert "--siblings" in complete("compare", "--") and "--siblings" not in complete("run", "--")


def test_cases_and_files_are_offered_where_one_belongs(complete):
    assert complete("run", "column_s") == {"column_shallow", "column_small"}
    assert complete("run", "--quiet", "column_c") == {"column_ci"}  # which takes no value
    assert complete("run", "--seed", "3", "column_c") == {"column_ci"}  # which does
    assert complete("run", "mine") == {"mine.toml"}
    assert complete("run", "--seed", "column_c") == set()  # a number


def test_values_are_offered(complete):
    assert complete("compare", "--kernel", "g") == {"gauss"}
    assert complete("run", "--out", "re") == {"results"}
    assert complete("run", "--out", "=", "re") == {"results"}
    assert complete("completion", "z") == {"zsh"}
    assert complete("completion", "bash", "z") == set()  # there is no second word


def test_keys_and_their_values_are_offered(complete):
    schema = case.schema()
    assert complete("run", "--set", "geometry.") == {f"geometry.{k}=" for k in schema["geometry"]}
    choices = set(schema["walls"]["gate"]["choices"])
    assert complete("run", "--set", "walls.gate", "=") == choices
    assert complete("run", "--set", "walls.gate", "=", "inst") == {"instantaneous"}
    assert complete("run", "--set", "title", "=", "") == set()


def test_a_case_of_a_name_that_a_shell_would_run_is_a_name(known, tmp_path):
    """Names are compared, not expanded."""
    for name in ("$(touch made)", "column"):
        (tmp_path / "cases" / name).mkdir(parents=True)
        (tmp_path / "cases" / name / "case.toml").touch()
    text = completion.script("bash", known).replace(f"{ROOT}/cases", "cases")
    (tmp_path / "script").write_text(text)
    line = DRIVE.format(script="./script", words="grainpair run ''", last=2)
    done = subprocess.run(
        ["bash", "--norc", "-c", line], capture_output=True, text=True, cwd=tmp_path
    )
    assert set(done.stdout.splitlines()) == {"$(touch made)", "column"}
    assert not (tmp_path / "made").exists()


# As bashcompinit calls it: in sh's ways, with words that = does not part.
DRIVE_ZSH = """
source ./script
offer() {
  emulate -L sh
  setopt kshglob noshglob braceexpand
  local -a COMP_WORDS COMPREPLY
  COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
  _grainpair
  printf '%s\\n' "${COMPREPLY[@]}"
}
print ${_comps[grainpair]}
offer grainpair run column_s
offer grainpair run --set walls.gate=inst
offer grainpair compare --kernel=g
"""


@pytest.mark.skipif(not shutil.which("zsh"), reason="needs zsh")
def test_zsh_takes_it(known, tmp_path):
    (tmp_path / "script").write_text(completion.script("zsh", known))
    shell = ["zsh", "-f", "-c", DRIVE_ZSH]
    done = subprocess.run(shell, capture_output=True, text=True, cwd=tmp_path, timeout=60)
    registered, *offered = done.stdout.splitlines()
    assert "_grainpair" in registered, done.stderr
    assert offered == [
        "column_shallow",
        "column_small",
        "walls.gate=instantaneous",
        "--kernel=gauss",
    ]


@pytest.mark.skipif(not shutil.which("man"), reason="needs man-db and groff")
def test_the_manual_page_has_every_command_and_no_warning(known, tmp_path):
    page = man.page(known, "1.2.3")
    (tmp_path / "grainpair.1").write_text(page)

    def shown(file) -> subprocess.CompletedProcess:
        around = {"LC_ALL": "C.UTF-8", "MANWIDTH": "100", "PATH": "/usr/bin:/bin"}
        command = ["man", "--warnings=w", "-l", file]
        return subprocess.run(command, capture_output=True, text=True, env=around, timeout=60)

    done = shown(tmp_path / "grainpair.1")
    assert (done.returncode, done.stderr) == (0, "")
    for command in known:
        assert re.search(rf"^   {command.name}$", done.stdout, re.MULTILINE), command.name
        for one in command.options:
            assert "--help" in one.flags or all(flag in done.stdout for flag in one.flags)
    assert "%(default)s" not in page and "INVALID" not in page
    (tmp_path / "broken.1").write_text(page.replace(".SH COMMANDS", ".SH COMMANDS\n.nosuch"))
    assert "nosuch" in shown(tmp_path / "broken.1").stderr  # a mistake would be seen


def test_nothing_in_a_text_is_a_request_of_troff():
    assert man.text(".so /etc/passwd") == r"\&.so /etc/passwd"
    assert man.text(r"a\b-'c") == r"a\(rsb\-\(aqc"


def call(*words) -> subprocess.CompletedProcess:
    command = module("compare", *words)
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, timeout=300)


@pytest.mark.parametrize(
    "words, hint",
    [
        (["rum"], "'run'"),
        (["desrcibe"], "'describe'"),
        (["law_tset"], "'law-test'"),
        (["run", "colum_small"], "'column_small'"),
        (["run", "cases/colum_small/case.toml"], "'column_small'"),
    ],
)
def test_a_misspelt_word_is_corrected_in_one_line(words, hint):
    done = call(*words)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1 and f"Did you mean {hint}?" in done.stderr


def test_a_word_that_is_like_none_gets_no_hint(tmp_path):
    assert "Did you mean" not in call("xyzzy").stderr
    assert meant("xyzzy", files()) == ""
    missing = tmp_path / "xyzzy" / "case.toml"
    assert find_case(str(missing)) == missing  # whoever opens it says what is wrong
    with pytest.raises(CaseError, match="no such case"):
        find_case("xyzzy")


def test_scenes_are_listed_with_what_they_take():
    told = {one["name"]: one for one in json.loads(call("cases", "--json").stdout)}
    assert "column_ci" in told and "shear" not in told  # which is an element test
    for name, one in told.items():
        assert one["title"] == case.load(ROOT / "cases" / name)["title"]
        for engine, count in (("grains", "grains"), ("continuum", "points")):
            assert one[engine][count] > 0 and one[engine]["seconds"] > 0
        assert one["picture"] == f"docs/pictures/scenes/{name}.svg"
        scene = case.load(ROOT / "cases" / name)
        assert (ROOT / one["picture"]).read_text() == scenes.draw(scene), name
        assert f"| `{name}` ![{scenes.words(scene)}](" in scenes.PAGE.read_text(), name
    high = case.load(ROOT / "cases" / "column_ci", ["geometry.height=0.021"])
    assert scenes.draw(high) != (ROOT / told["column_ci"]["picture"]).read_text()
    assert told["column"]["grains"]["grains"] > told["column_ci"]["grains"]["grains"]
    table = call("cases").stdout
    assert all(f"\n{name} " in table and one["title"] in table for name, one in told.items())


def test_completion_and_manual_need_nothing_built():
    assert not targets(["completion", "bash"]) and not targets(["man"])
    assert targets(["cases"]) == ["programs"]
