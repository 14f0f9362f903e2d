"""What every program that a sweep starts is called like: CONFIG KEY -o RESULT.json."""

import json
import os
from pathlib import Path

from cases import command_line
from cases.files import write_atomically
from cases.programs import ROOT


def run(program: str, doc: str, make) -> int:
    """make(case, task) -> what RESULT.json holds; CONFIG names the case and, under KEY, the task
    (compare/study/sweep.py).
    """
    parser = command_line.Parser(prog=program, description=doc.splitlines()[0])
    parser.add_argument("config", type=Path)
    parser.add_argument("key")
    parser.add_argument("-o", "--out", type=Path, required=True)
    options = parser.parse_args()
    config, out = json.loads(options.config.read_text()), options.out.resolve()
    os.chdir(ROOT)  # so that commands in the result are those that a user there can give
    made = make(Path(config["case"]), config["recipes"][options.key])
    write_atomically(out, json.dumps(made))
    return 0
