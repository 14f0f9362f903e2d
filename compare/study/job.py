"""What every program that a sweep starts is called like: CASE TASK -o RESULT.json."""

import json
import os
from pathlib import Path

from cases import command_line
from cases.errors import exit_code
from cases.files import write_atomically
from cases.programs import ROOT


def run(program: str, doc: str, make) -> int:
    """make(case, task) -> what RESULT.json holds; TASK is JSON (compare/study/sweep.py)."""
    parser = command_line.Parser(prog=program, description=doc.splitlines()[0])
    parser.add_argument("case", type=Path)
    parser.add_argument("task", type=json.loads)
    parser.add_argument("-o", "--out", type=Path, required=True)
    options = parser.parse_args()
    out = options.out.resolve()
    os.chdir(ROOT)  # so that commands in the result are those that a user there can give

    def work() -> int:
        made = make(options.case, options.task)
        write_atomically(out, json.dumps(made))
        return 0

    return exit_code(work)
