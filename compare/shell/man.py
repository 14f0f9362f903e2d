"""The manual page, in the macros of man(7)."""

import re

from compare.parsers import ABOUT
from compare.shell.surface import Argument, Command
from compare.verdict.conclusion import EXIT_CODES

ENVIRONMENT = {
    "GRAINPAIR_BUILD": "Folder of the programs; by default build/release of the clone.",
    "GRAINPAIR_RUNS": "Folder of what is kept for other runs; by default runs of the clone.",
    "XDG_CACHE_HOME": "Where both go for a clone that belongs to somebody else.",
}


def page(commands: list[Command], version: str) -> str:
    """The page's source. It has no date, so that the same commands make the same page."""
    parts = [
        f'.TH GRAINPAIR 1 "" "grainpair {version}" "User Commands"',
        ".SH NAME",
        r"grainpair \- " + text(ABOUT.removeprefix("grainpair ").rstrip(".")),
        ".SH SYNOPSIS",
        r".B grainpair",
        r".I COMMAND",
        r"[\fIword\fR]... [\fIoption\fR]...",
        ".SH DESCRIPTION",
        text(ABOUT),
        "The commands, each with its options below:",
    ]
    for one in commands:
        parts += [".TP", f".B {text(one.name)}", text(one.summary)]
    parts.append(".SH COMMANDS")
    for one in commands:
        parts += section(one)
    parts += [".SH EXIT STATUS", *paragraphs(EXIT_CODES.partition("\n")[2]), ".SH ENVIRONMENT"]
    for name, words in ENVIRONMENT.items():
        parts += [".TP", f".B {text(name)}", text(words)]
    return "\n".join(parts) + "\n"


def section(command: Command) -> list[str]:
    parts = [f".SS {text(command.name)}", ".nf", text(command.usage), ".fi"]
    parts += [".PP", text(command.summary), *paragraphs(command.text)]
    for one in command.arguments:
        if "--help" not in one.flags:
            parts += [".TP", f".B {text(name_of(one))}", text(one.help or "see above")]
    if command.epilog != EXIT_CODES:
        parts += paragraphs(command.epilog)
    return parts


def name_of(argument: Argument) -> str:
    return argument.shown or "word"


def paragraphs(words: str) -> list[str]:
    """Paragraphs of a docstring; what is indented keeps its lines."""
    out = []
    for block in re.split(r"\n\s*\n", words):
        if not block.strip():
            continue
        if block.startswith(" "):
            out += [".PP", ".nf", *(text(line) for line in block.rstrip().splitlines()), ".fi"]
        else:
            out += [".PP", text(" ".join(block.split()))]
    return out


def text(words: str) -> str:
    """Words as troff prints them: nothing in them is a request or an escape."""
    safe = words.replace("\\", r"\(rs").replace("-", r"\-")
    safe = (
        safe.replace("'", r"\(aq").replace("`", r"\(ga").replace("^", r"\(ha").replace("~", r"\(ti")
    )
    return rf"\&{safe}" if safe.startswith((".", " ")) else safe
