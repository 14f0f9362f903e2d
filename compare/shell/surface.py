"""All that can be typed after `grainpair`: commands, their words and options, what those take."""

import argparse
from dataclasses import dataclass
from pathlib import Path

from cases.case import schema
from compare.parsers import all_commands, summary

# What a word or the value of an option is, as far as anybody can complete it.
CASE, KEY, FILE, FOLDER, CHOICE, WORD, NOTHING = (
    "case",
    "key",
    "file",
    "folder",
    "choice",
    "word",
    "nothing",
)


@dataclass(frozen=True)
class Argument:
    """A word of a command, or an option by its `flags`."""

    flags: tuple[str, ...]  # () of a word
    shown: str  # how usage writes it, flags included
    help: str
    takes: str
    choices: tuple[str, ...] = ()
    several: bool = False  # as many words as one likes


@dataclass(frozen=True)
class Command:
    name: str
    summary: str
    text: str  # the paragraphs below the summary
    epilog: str
    usage: str
    arguments: tuple[Argument, ...]

    @property
    def words(self) -> list[Argument]:
        return [one for one in self.arguments if not one.flags]

    @property
    def options(self) -> list[Argument]:
        return [one for one in self.arguments if one.flags]


def commands() -> list[Command]:
    """Raises EngineError where a package is missing that one of them imports."""
    return [command(name, parser) for name, parser in all_commands().items()]


def command(name: str, parser: argparse.ArgumentParser) -> Command:
    doc = parser.description or ""
    usage = " ".join(parser.format_usage().split()).removeprefix("usage: ")
    arguments = tuple(argument(action, parser) for action in parser._actions)
    text = doc.partition("\n\n")[2]
    return Command(name, summary(doc), text, parser.epilog or "", usage, arguments)


def argument(action: argparse.Action, parser: argparse.ArgumentParser) -> Argument:
    """argparse has no public way to its actions, and its own help uses these."""
    formatter = argparse.HelpFormatter(parser.prog, width=10_000, max_help_position=100)
    shown = formatter._format_action_invocation(action)
    told = formatter._expand_help(action) if action.help else ""
    choices = tuple(map(str, action.choices or ()))
    return Argument(
        tuple(action.option_strings),
        shown,
        told,
        takes(action),
        choices,
        action.nargs in ("*", "+", argparse.REMAINDER),
    )


def takes(action: argparse.Action) -> str:
    if action.nargs == 0:
        return NOTHING
    if action.choices:
        return CHOICE
    if "--set" in action.option_strings or action.metavar == "WORD":
        return KEY
    if action.dest == "case" or action.metavar == "CASE":
        return CASE
    if action.type is Path:
        return FOLDER if action.metavar == "DIR" else FILE
    return FILE if action.nargs == argparse.REMAINDER else WORD


def keys() -> dict[str, list[str]]:
    """Every key of a scene, with the values that it may have where they can be listed."""
    out: dict[str, list[str]] = {}

    def walk(table: dict, start: str):
        for name, entry in table.items():
            if not isinstance(entry, dict):
                continue
            if isinstance(entry.get("type"), str):
                truth = ["true", "false"] if entry["type"] == "boolean" else []
                out[start + name] = list(entry.get("choices", truth))
            else:
                walk(entry, f"{start}{name}.")

    walk(schema(), "")
    return out
