"""What a command line of grainpair needs built: prints ninja's targets, or nothing.

A command's file says it, as `TARGETS = ["…"]` or as a function `targets(words)`; where it says
neither, it needs all the programs. Help, the version and words that are no command need nothing.
Only Python's own library is imported: the launcher asks before anything is installed.
"""

import ast
import importlib
import sys
from pathlib import Path

COMMANDS = Path(__file__).parent / "commands"
HELP = {"-h", "--help", "--version"}


def targets(words: list[str]) -> list[str]:
    """Targets of the build that the command line `words` (without the launcher's name) needs."""
    file = COMMANDS / f"{words[0]}.py" if words else None
    if file is None or not file.is_file() or HELP & set(words):
        return []
    for node in ast.parse(file.read_text()).body:
        match node:
            case ast.Assign(targets=[ast.Name("TARGETS")], value=value):
                return ast.literal_eval(value)
            case ast.FunctionDef(name="targets"):
                return importlib.import_module(f"compare.commands.{file.stem}").targets(words[1:])
    return ["programs"]


if __name__ == "__main__":
    print(*targets(sys.argv[1:]))
