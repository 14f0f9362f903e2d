"""README and tutorials, followed literally: every `sh` block is typed into a clone as it stands.

What the text says is printed (the `text` block after it; `…` stands for anything) must be, line by
line and in order. Blocks below a line that begins `*Left out of the tests:` are not run; the reason
stands there.
"""

import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

from cases.programs import ROOT, program

INDEX = (ROOT / "docs" / "index.md").read_text()
TUTORIALS = re.findall(r"^tutorials/(\w+)$", INDEX, flags=re.M)  # in the order of the site
FOLLOWED = [ROOT / "README.md"] + [ROOT / "docs" / "tutorials" / f"{one}.md" for one in TUTORIALS]
SECONDS = 300  # of the clock, for one command on a busy machine


@dataclass
class Block:
    commands: list[str]
    printed: list[str]  # what the text says of it
    reason: str  # why it is left out; empty where it is run


def blocks(text: str) -> list[Block]:
    """The `sh` blocks of a page. Lines are commands of their own, but where a block holds a text
    for a command (`<<`).
    """
    found: list[Block] = []
    parts = re.split(r"^```(\w*)\n(.*?)^```$", text, flags=re.M | re.S)
    for before, language, body in zip(parts[::3], parts[1::3], parts[2::3]):
        if language == "sh":
            left = re.search(r"^\*Left out of the tests: (.+?)\*\s*\Z", before, re.M | re.S)
            lines = [body] if "<<" in body else body.splitlines()
            found.append(Block(lines, [], left[1] if left else ""))
        elif language == "text":
            found[-1].printed = body.splitlines()
    return found


def lacking(expected: list[str], output: str) -> str:
    """The first line that was to be printed and was not; empty where all were, in order."""
    lines = iter(line.strip() for line in output.splitlines())
    for wanted in expected:
        pattern = ".*".join(map(re.escape, wanted.strip().split("…")))
        if not any(re.fullmatch(pattern, line) for line in lines):
            return wanted
    return ""


def typed(command: str, clone: Path) -> subprocess.CompletedProcess:
    """What a shell in the clone makes of a command, nothing around it but where the build is."""
    return subprocess.run(
        ["bash", "-e", "-o", "pipefail", "-c", command],
        cwd=clone,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=SECONDS,
        env={"PATH": os.environ["PATH"], "GRAINPAIR_BUILD": str(program(""))},
        check=False,
    )


def follow(text: str, clone: Path, printed: dict[str, str]) -> list[str]:
    """What goes wrong when somebody does what a page says. `printed` is what earlier commands
    have: none is given twice.
    """
    wrong = []
    for block in blocks(text):
        if block.reason:
            continue
        output = ""
        for line in block.commands:
            command = line if "\n" in line else re.sub(r"\s+# .*", "", line)
            if command not in printed:
                done = typed(command, clone)
                if done.returncode:
                    wrong.append(f"{command}: exit code {done.returncode}: {done.stdout[-500:]}")
                printed[command] = done.stdout
            output += printed[command]
        if lost := lacking(block.printed, output):
            wrong.append(f"{block.commands[-1]}: not printed: {lost}\n{output[-2000:]}")
    return wrong


@pytest.fixture(scope="module")
def clone(tmp_path_factory) -> Path:
    """A clone without results, whose build is that of the tests."""
    target = tmp_path_factory.mktemp("followed") / "clone"
    for folder in ("cases", "compare", "dem_reference", "docs", "mpm"):
        shutil.copytree(
            ROOT / folder, target / folder, ignore=shutil.ignore_patterns("__pycache__")
        )
    lists = [file.name for file in ROOT.glob("packages*.txt")]
    for name in ("grainpair", "CMakeLists.txt", "CMakePresets.json", *lists):
        shutil.copy(ROOT / name, target / name)
    (target / "build").mkdir()
    (target / "build" / "release").symlink_to(program(""))
    return target


def test_readme_and_tutorials_do_what_they_say(clone):
    printed: dict[str, str] = {}
    wrong = {page.name: follow(page.read_text(), clone, printed) for page in FOLLOWED}
    told = [f"{page}: {line}" for page, lines in wrong.items() for line in lines]
    assert not told, "\n".join(told)


def test_every_tutorial_is_followed():
    assert {page.stem for page in (ROOT / "docs" / "tutorials").glob("*.md")} == set(TUTORIALS)
    run = [block for page in FOLLOWED for block in blocks(page.read_text()) if not block.reason]
    assert all(any(not b.reason for b in blocks(page.read_text())) for page in FOLLOWED)
    assert sum(bool(block.printed) for block in run) > len(run) // 2  # or little is checked


@pytest.mark.parametrize(
    "text",
    [
        "```sh\n./grainpair descibe title\n```\n",
        "```sh\n./grainpair describe title --knid scene\n```\n",
        "```sh\n./grainpair describe title\n```\n\n```text\ntitle…\nanother line\n```\n",
        "```sh\nmkdir -p a\ncat b\n```\n",
    ],
)
def test_a_page_that_is_wrong_is_noticed(clone, text):
    assert follow(text, clone, {})


def test_a_block_that_is_right_is_not(clone):
    text = "```sh\n./grainpair describe title  # a key\n```\n\nSays\n\n```text\ntitle…\n```\n"
    assert follow(text, clone, {}) == []
    left = "*Left out of the tests: it is\nlong.*\n\n```sh\nfalse\n```\n"
    assert [block.reason for block in blocks(left)] == ["it is\nlong."]
    assert follow(left, clone, {}) == [] and follow(left.partition("\n\n")[2], clone, {})
