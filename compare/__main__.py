"""grainpair runs a granular scene as a continuum and grain by grain, and compares the two.

Each command is a module of compare/commands: the first paragraph of its docstring is its help,
`arguments(parser)` declares its options, `run(options)` does it and returns the exit code;
compare/targets.py says what it needs built.
"""

import argparse
import ast
import importlib
import signal
import sys
from pathlib import Path

from cases.command_line import Parser
from cases.errors import exit_code

COMMANDS = Path(__file__).parent / "commands"


class Version(argparse.Action):
    """Prints versions and ends; what they are is asked only then."""

    def __call__(self, parser, *_):
        version = importlib.import_module("compare.version")
        print(version.text())
        parser.exit()


def parser_for(words: list[str]) -> Parser:
    """The parser of the whole program; imports the module of the command `words` start with only.

    Where help is asked on a machine that lacks a package the command imports, its options are left
    out, and the help says so.
    """
    parser = Parser(
        prog="grainpair",
        description=(__doc__ or "").splitlines()[0],
        formatter_class=lambda prog: argparse.HelpFormatter(prog, indent_increment=1),
    )
    parser.add_argument(
        "--version", action=Version, nargs=0, help="show versions and exit; builds nothing"
    )
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for file in sorted(COMMANDS.glob("[a-z]*.py")):
        doc = ast.get_docstring(ast.parse(file.read_text())) or ""
        command = commands.add_parser(
            file.stem,
            help=" ".join(doc.split("\n\n")[0].split()),
            description=doc,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        if words[:1] == [file.stem]:
            try:
                module = importlib.import_module(f"compare.commands.{file.stem}")
            except ModuleNotFoundError as missing:
                if not {"-h", "--help"} & set(words):
                    raise
                command.epilog = f"(options: once {missing.name} is installed, as any run does)"
                continue
            module.arguments(command)
            command.set_defaults(run=module.run)
    return parser


def main(words: list[str]) -> int:
    # A terminated launcher must end its engines and clear its scratch folder, as an interrupted
    # one does.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    parser = parser_for(words)
    if not words:
        parser.print_help()
        return 2
    options = parser.parse_args(words)
    try:
        return exit_code(lambda: options.run(options))
    except KeyboardInterrupt:
        print("grainpair: interrupted", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
