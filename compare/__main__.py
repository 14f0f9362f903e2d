"""grainpair runs a granular scene as a continuum and grain by grain, and compares the two.

Each command is a module of compare/commands: the first line of its docstring is its help, `arguments(parser)` declares
its options, `run(options)` does it and returns the exit code.
"""

import argparse
import ast
import importlib
import signal
import sys
from pathlib import Path

from cases.errors import CaseError, EngineError

COMMANDS = Path(__file__).parent / "commands"


def parser_for(words: list[str]) -> argparse.ArgumentParser:
    """The parser of the whole program; imports the module of the command that `words` start with, no other."""
    parser = argparse.ArgumentParser(
        prog="grainpair",
        description=__doc__.splitlines()[0],
        formatter_class=lambda prog: argparse.HelpFormatter(prog, indent_increment=1),
    )
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for file in sorted(COMMANDS.glob("[a-z]*.py")):
        doc = ast.get_docstring(ast.parse(file.read_text())) or ""
        command = commands.add_parser(
            file.stem,
            help=doc.split("\n")[0],
            description=doc,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        if words[:1] == [file.stem]:
            module = importlib.import_module(f"compare.commands.{file.stem}")
            module.arguments(command)
            command.set_defaults(run=module.run)
    return parser


def main(words: list[str]) -> int:
    # A terminated launcher must end its engines and clear its scratch folder, as an interrupted one does.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    options = parser_for(words).parse_args(words)
    try:
        return options.run(options)
    except CaseError as error:
        print(error, file=sys.stderr)
        return 2
    except EngineError as error:
        print(error, file=sys.stderr)
        return 3
    except KeyboardInterrupt:
        print("grainpair: interrupted", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
