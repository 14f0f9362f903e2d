"""MESSAGES.md: every line that grainpair says when it refuses, fails or warns, and what to do.

    /usr/bin/python3 -m tests.messages [--check]

The lines are taken from the sources, what they mean from tests/data/messages.toml, whose entries
are told apart by patterns. With --check nothing is written: the exit code says whether the page is
that of the sources, with an entry for each line and a line for each entry.
"""

import ast
import html
import re
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field

from cases.files import write_atomically
from cases.programs import ROOT

PAGE, ENTRIES = ROOT / "MESSAGES.md", ROOT / "tests/data/messages.toml"
FOLDERS = ("cases", "mpm", "dem_reference", "compare")
# What takes a message as one of its arguments: in Python, and in C++.
RAISED = {"CaseError", "EngineError", "Incomplete", "ArgumentTypeError", "Unmade"}
CALLS = re.compile(
    r"\b(refuse|refuse_line|say|SolverError|CaseError|RoomError|Error|runtime_error|Fault|"
    r"invalid_argument|fmt::print)\s*[({]"
)
LITERAL = re.compile(r'"((?:\\.|[^"\\])*)"')
HOLE = "…"
HEAD = """# Messages

What grainpair says when it refuses, fails or warns: what it means, what to do. A message is one
line, *where: problem (why) hint*, on standard error; the exit code is 2 for bad input, 3 when an
engine or the machine fails. … stands for what is filled in. A line that ends in a word in brackets,
as `[energy-growth]`, has that word as its code, which stays where the line is reworded.

This page is made of the sources and of `tests/data/messages.toml` by
`/usr/bin/python3 -m tests.messages`.
"""


@dataclass
class Entry:
    """A kind of message: `group` is the page's section, `pattern` what is found in its lines."""

    group: str
    words: str  # of the section
    title: str
    pattern: str
    means: str
    do: str
    files: list[str] = field(default_factory=list)  # how the paths of its sources begin; all: none
    of_library: bool = False  # its words are not in what the sources throw
    lines: list[str] = field(default_factory=list)

    def takes(self, line: str, file: str) -> bool:
        ours = not self.files or file.startswith(tuple(self.files))
        return ours and not self.of_library and bool(re.search(self.pattern, line))


def python_lines(text: str) -> Iterator[str]:
    """The messages that a module raises, what is filled in as HOLE."""
    for call in ast.walk(ast.parse(text)):
        if not isinstance(call, ast.Call) or not call.args:
            continue
        name = call.func.attr if isinstance(call.func, ast.Attribute) else None
        name = call.func.id if isinstance(call.func, ast.Name) else name
        if name in RAISED:
            yield from templates(call.args[0])


def templates(node: ast.expr) -> list[str]:
    """The texts that an expression can be."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return [node.value]
    if isinstance(node, ast.JoinedStr):
        parts = [str(one.value) if isinstance(one, ast.Constant) else HOLE for one in node.values]
        return ["".join(parts)]
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return [a + b for a in templates(node.left) for b in templates(node.right)]
    if isinstance(node, ast.IfExp):
        return templates(node.body) + templates(node.orelse)
    return [HOLE]


def arguments(text: str, start: int) -> list[str]:
    """The arguments of a call of C++, from behind its parenthesis."""
    depth, at, begin, found = 1, start, start, []
    while at < len(text) and depth:
        if literal := LITERAL.match(text, at):
            at = literal.end()
            continue
        c = text[at]
        depth += (c in "([{") - (c in ")]}")
        if (c == "," and depth == 1) or depth == 0:
            found.append(text[begin:at])
            begin = at + 1
        at += 1
    return found


def cpp_lines(text: str) -> Iterator[str]:
    """The messages of a file of C++, what is filled in as HOLE."""
    text = re.sub(r"(?m)^\s*//.*$", "", text)
    for call in CALLS.finditer(text):
        found = arguments(text, call.end())
        if call[1] == "fmt::print" and (not found or found[0] != "stderr"):
            continue
        told = max(found, key=lambda one: sum(map(len, LITERAL.findall(one))), default="")
        if "fmt::format(" in told:
            told = arguments(told, told.index("fmt::format(") + len("fmt::format("))[0]
        words = re.sub(r'"\s*(?=")', '"', told)  # literals side by side are one
        parts = [part for part in re.split(r'("(?:\\.|[^"\\])*")', words) if part.strip()]
        line = "".join(ast.literal_eval(part) if part.startswith('"') else HOLE for part in parts)
        yield re.sub(r"\{[^{}]*\}", HOLE, line.replace("{{", "(").replace("}}", ")"))


def lines() -> dict[str, str]:
    """All messages, each with the file that it is of; those that hold no word of ours are none."""
    found: dict[str, str] = {}
    for folder in FOLDERS:
        for file in sorted((ROOT / folder).rglob("*")):
            if file.suffix not in (".py", ".cpp", ".hpp") or "bench" in file.parts:
                continue
            told = python_lines if file.suffix == ".py" else cpp_lines
            for line in told(file.read_text()):
                line = re.sub(rf"{HOLE}(\s*{HOLE})+", HOLE, " ".join(line.split()))
                if re.search(r"[a-z]{3}", line):
                    found.setdefault(line, str(file.relative_to(ROOT)))
    return found


def entries() -> list[Entry]:
    """The entries of the file, in its order."""
    found = []
    for group in tomllib.loads(ENTRIES.read_text())["group"]:
        found += [Entry(group["name"], group["words"], **one) for one in group["entry"]]
    return found


def sorted_in(known: list[Entry], told: dict[str, str]) -> list[str]:
    """Gives each line to the first entry that takes it; returns what is wrong, a line each."""
    faults = []
    for line, file in told.items():
        taker = next((one for one in known if one.takes(line, file)), None)
        if taker is None:
            faults.append(f"{file}: no entry for '{line}'")
        else:
            taker.lines.append(line)
    faults += [
        f"{ENTRIES.name}: '{one.title}' has {'a line' if one.lines else 'no line'} in the sources"
        for one in known
        if bool(one.lines) == one.of_library
    ]
    return faults


def page(known: list[Entry]) -> str:
    """MESSAGES.md."""
    out = [HEAD]
    for i, one in enumerate(known):
        if not i or known[i - 1].group != one.group:
            out.append(f"## {one.group}\n\n{one.words}\n")
        out.append(f"### {one.title}\n\n{one.means}\n\n**What to do.** {one.do}\n")
        if one.lines:
            count = f"{len(one.lines)} line{'s' * (len(one.lines) > 1)}"
            rows = html.escape("\n".join(sorted(one.lines)), quote=False)
            out.append(f"<details><summary>{count}</summary>\n<pre>\n{rows}\n</pre>\n</details>\n")
    return "\n".join(out)


def main() -> int:
    known = entries()
    faults = sorted_in(known, lines())
    text = page(known)
    if "--check" not in sys.argv:
        write_atomically(PAGE, text)
    elif not PAGE.exists() or PAGE.read_text() != text:
        faults.append("MESSAGES.md: not that of the sources: /usr/bin/python3 -m tests.messages")
    print("\n".join(faults), file=sys.stderr)
    return 2 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
