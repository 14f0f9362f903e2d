"""The parsers of the launcher's commands, which help, completion and the man page are made of.

Each command is a module of compare/commands: the first paragraph of its docstring is its help,
`arguments(parser)` declares its options, `run(options)` does it and returns the exit code.
"""

import argparse
import ast
import importlib
from pathlib import Path

from cases.command_line import Parser
from cases.errors import CaseError, EngineError
from cases.lookup import meant

COMMANDS = Path(__file__).parent / "commands"
ABOUT = "grainpair runs a granular scene as a continuum and grain by grain, and compares the two."


class Version(argparse.Action):
    """Prints versions and ends; what they are is asked only then."""

    def __call__(self, parser, *_):
        version = importlib.import_module("compare.version")
        print(version.text())
        parser.exit()


def files() -> dict[str, Path]:
    """The module of each command, by the name a user types."""
    return {file.stem.replace("_", "-"): file for file in sorted(COMMANDS.glob("[a-z]*.py"))}


def refuse_unknown(words: list[str]):
    """Raises CaseError where a command line starts with a word that is no command."""
    known = files()
    word = words[0] if words else ""
    if word and not word.startswith("-") and word.replace("_", "-") not in known:
        raise CaseError(f"grainpair: {word}: no such command.{meant(word, known)} (see --help)")


def parser_for(words: list[str]) -> Parser:
    """The parser of the whole program; imports the module of the command `words` start with only.

    Where help is asked on a machine that lacks a package the command imports, its options are left
    out, and the help says so.
    """
    parser = Parser(
        prog="grainpair",
        description=ABOUT,
        formatter_class=lambda prog: argparse.HelpFormatter(prog, indent_increment=1),
    )
    parser.add_argument(
        "--version", action=Version, nargs=0, help="show versions and exit; builds nothing"
    )
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for name, file in files().items():
        doc = ast.get_docstring(ast.parse(file.read_text())) or ""
        command = commands.add_parser(
            name,
            aliases=[] if name == file.stem else [file.stem],
            help=summary(doc),
            description=doc,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        if words[:1] in ([name], [file.stem]):
            try:
                declare(command, file.stem)
            except ModuleNotFoundError as missing:
                if not {"-h", "--help"} & set(words):
                    raise
                command.epilog = f"(options: once {missing.name} is installed, as any run does)"
    return parser


def summary(doc: str) -> str:
    """A docstring's first paragraph, in one line."""
    return " ".join(doc.split("\n\n")[0].split())


def declare(parser: Parser, module_name: str):
    """Adds what a command's module declares."""
    module = importlib.import_module(f"compare.commands.{module_name}")
    module.arguments(parser)
    parser.set_defaults(run=module.run)


def all_commands() -> dict[str, Parser]:
    """The complete parser of every command, by name. Raises EngineError where a package is missing
    that one of them imports.
    """
    out = {}
    for name, file in files().items():
        doc = ast.get_docstring(ast.parse(file.read_text())) or ""
        out[name] = Parser(
            prog=f"grainpair {name}",
            description=doc,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        try:
            declare(out[name], file.stem)
        except ModuleNotFoundError as missing:
            raise EngineError(
                f"grainpair: {missing.name}: no such module (not installed) any ./grainpair run "
                "installs it"
            ) from missing
    return out
